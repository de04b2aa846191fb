/* Nanoseconds per pair of a batch, as scripts/capi_overhead.sh compares them with Rust's:
 *
 *     overhead TABLE PAIRS REPEATS
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <sateen.h>

/* Directions above the surface, the same that the Rust program takes. */
static void fill(float *w[3], size_t pairs, unsigned state) {
    for (size_t pair = 0; pair < pairs; ++pair) {
        float u[2];
        for (int k = 0; k < 2; ++k) {
            state = state * 1664525u + 1013904223u;
            u[k] = (float)(state >> 8) / 16777216.0f;
        }
        const float z = 0.05f + 0.95f * u[0], r = sqrtf(1.0f - z * z), phi = 6.2831853f * u[1];
        w[0][pair] = r * cosf(phi);
        w[1][pair] = r * sinf(phi);
        w[2][pair] = z;
    }
}

/* Nanoseconds since START; seconds are subtracted as integers, since a double of all of today's nanoseconds has steps of 256. */
static double since(struct timespec start) {
    struct timespec time;
    timespec_get(&time, TIME_UTC);
    return (double)(time.tv_sec - start.tv_sec) * 1e9 + (double)(time.tv_nsec - start.tv_nsec);
}

int main(int argc, char **argv) {
    if (argc != 4) {
        return 2;
    }
    sateen_table *table;
    char message[512];
    if (sateen_from_file(argv[1], &table, message, sizeof message) != SATEEN_OK) {
        fprintf(stderr, "%s\n", message);
        return 1;
    }
    const size_t pairs = strtoul(argv[2], NULL, 10), repeats = strtoul(argv[3], NULL, 10);
    float *slices[9];
    for (int k = 0; k < 9; ++k) {
        slices[k] = malloc(pairs * sizeof(float));
        if (slices[k] == NULL) {
            return 1;
        }
    }
    fill(slices, pairs, 1);
    fill(slices + 3, pairs, 2);
    const sateen_directions wi = {slices[0], slices[1], slices[2]}, wr = {slices[3], slices[4], slices[5]};
    const sateen_colours rho = {slices[6], slices[7], slices[8]};
    double least = INFINITY;
    for (size_t repeat = 0; repeat < repeats; ++repeat) {
        struct timespec start;
        timespec_get(&start, TIME_UTC);
        if (sateen_eval_cos_batch(table, pairs, wi, wr, rho) != SATEEN_OK) {
            return 1;
        }
        const double taken = since(start) / (double)pairs;
        least = taken < least ? taken : least;
    }
    printf("%.3f %g\n", least, (double)rho.r[pairs / 2]);
    for (int k = 0; k < 9; ++k) {
        free(slices[k]);
    }
    sateen_free(table);
    return 0;
}
