/* Shades a row of pixels of a cloth under one light, one at a time and as a batch:
 *
 *     shade TABLE
 *
 * prints for each pixel the radiance that the cloth sends to the viewer, as decimals and as bits.
 */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <sateen.h>

enum { PIXELS = 37, MOST_THREADS = 64 };

/* The light, and what arrives from it where it stands upright above the surface: linear RGB. */
static const float LIGHT[3] = {0.36f, 0.48f, 0.8f};
static const float ARRIVES[3] = {3.0f, 2.9f, 2.7f};

/* The viewer of a pixel: lower and lower along the warp. */
static void viewer(int pixel, float wr[3]) {
    const float x = -0.95f + 1.9f * (float)pixel / (float)(PIXELS - 1);
    wr[0] = x;
    wr[1] = 0.0f;
    wr[2] = sqrtf(1.0f - x * x);
}

static void print(const char *what, int pixel, const float rgb[3]) {
    printf("%s %2d", what, pixel);
    for (int channel = 0; channel < 3; ++channel) {
        uint32_t bits;
        memcpy(&bits, &rgb[channel], sizeof bits);
        printf("  %.6f %08" PRIx32, (double)rgb[channel], bits);
    }
    printf("\n");
}

int main(int argc, char **argv) {
    sateen_table *table;
    char message[512];
    if (argc != 2) {
        fprintf(stderr, "usage: shade TABLE\n");
        return 2;
    }
    if (sateen_from_file(argv[1], &table, message, sizeof message) != SATEEN_OK) {
        fprintf(stderr, "shade: %s\n", message);
        return 1;
    }
    const size_t threads = sateen_thread_count(table);
    for (size_t thread = 0; thread < threads; ++thread) {
        float albedo[3];
        if (sateen_thread_albedo(table, thread, albedo) == SATEEN_OK) {
            printf("thread %s  %.4f %.4f %.4f\n", sateen_thread_name(table, thread), (double)albedo[0], (double)albedo[1],
                   (double)albedo[2]);
        }
    }

    /* One pixel at a time: radiance = ρ times what arrives. */
    for (int pixel = 0; pixel < PIXELS; ++pixel) {
        float wr[3], rho[3];
        viewer(pixel, wr);
        if (sateen_eval_cos(table, LIGHT, wr, rho) != SATEEN_OK) {
            return 1;
        }
        for (int channel = 0; channel < 3; ++channel) {
            rho[channel] *= ARRIVES[channel];
        }
        print("pixel", pixel, rho);
    }

    /* All at once, dyed: every thread 0.3, 0.1, 0.02. A structure of arrays in, another out. */
    float albedos[MOST_THREADS][3];
    for (size_t thread = 0; thread < threads; ++thread) {
        albedos[thread][0] = 0.3f;
        albedos[thread][1] = 0.1f;
        albedos[thread][2] = 0.02f;
    }
    float lights[3][PIXELS], viewers[3][PIXELS], rgb[3][PIXELS];
    for (int pixel = 0; pixel < PIXELS; ++pixel) {
        float wr[3];
        viewer(pixel, wr);
        for (int k = 0; k < 3; ++k) {
            lights[k][pixel] = LIGHT[k];
            viewers[k][pixel] = wr[k];
        }
    }
    const sateen_directions wi = {lights[0], lights[1], lights[2]};
    const sateen_directions wr = {viewers[0], viewers[1], viewers[2]};
    const sateen_colours rho = {rgb[0], rgb[1], rgb[2]};
    const sateen_status status = sateen_eval_cos_batch_with(table, albedos[0], threads, PIXELS, wi, wr, rho);
    if (status != SATEEN_OK) {
        fprintf(stderr, "shade: %s\n", sateen_status_text(status));
        return 1;
    }
    for (int pixel = 0; pixel < PIXELS; ++pixel) {
        const float radiance[3] = {rgb[0][pixel] * ARRIVES[0], rgb[1][pixel] * ARRIVES[1], rgb[2][pixel] * ARRIVES[2]};
        print("dyed ", pixel, radiance);
    }
    sateen_free(table);
    return 0;
}
