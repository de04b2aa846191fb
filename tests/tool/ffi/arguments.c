/* Whatever is passed, there is a status and no crash; run under sanitizers: arguments STORED COMPRESSED. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sateen.h>

#define EXPECT(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            exit(1); \
        } \
    } while (0)

static char message[300];

static unsigned char *read_file(const char *path, size_t *length) {
    FILE *file = fopen(path, "rb");
    EXPECT(file != NULL);
    EXPECT(fseek(file, 0, SEEK_END) == 0);
    *length = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*length);
    EXPECT(bytes != NULL && fread(bytes, 1, *length, file) == *length);
    fclose(file);
    return bytes;
}

/* Each length in memory of its own, so that a sanitizer sees a read beyond it. */
static void prefixes(const unsigned char *bytes, size_t length) {
    for (size_t part = 0; part < length; part += 97) {
        unsigned char *copy = malloc(part ? part : 1);
        EXPECT(copy != NULL);
        memcpy(copy, bytes, part);
        sateen_table *table = (sateen_table *)message;
        const sateen_status status = sateen_from_mapped(copy, part, &table, message, sizeof message);
        EXPECT(status == SATEEN_LENGTH || status == SATEEN_NOT_A_TABLE);
        EXPECT(table == NULL && message[0] != 0);
        free(copy);
    }
}

static void loading(const char *path, const unsigned char *bytes, size_t length) {
    sateen_table *table = NULL;
    EXPECT(sateen_from_bytes(NULL, 10, &table, message, sizeof message) == SATEEN_NULL_ARGUMENT);
    EXPECT(strcmp(message, "bytes is null") == 0);
    EXPECT(sateen_from_bytes(bytes, length, NULL, message, sizeof message) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_from_bytes(bytes, (size_t)-1, &table, NULL, 0) == SATEEN_TOO_LARGE);
    EXPECT(sateen_from_file(NULL, &table, message, sizeof message) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_from_file("no/such.sateen", &table, message, sizeof message) == SATEEN_FILE);
    EXPECT(strstr(message, "no/such.sateen") != NULL);
    EXPECT(sateen_from_file(".", &table, message, sizeof message) == SATEEN_FILE);
    /* A message that has no room is shortened; ü is not cut through. */
    char little[4] = "xxx";
    EXPECT(sateen_from_file("no\xc3\xbc", &table, little, sizeof little) == SATEEN_FILE);
    EXPECT(strcmp(little, "no") == 0);
    EXPECT(sateen_from_file("no", &table, little, 1) == SATEEN_FILE && little[0] == 0);

    unsigned char *damaged = malloc(length);
    EXPECT(damaged != NULL);
    memcpy(damaged, bytes, length);
    damaged[40] ^= 1;
    EXPECT(sateen_from_bytes(damaged, length, &table, message, sizeof message) == SATEEN_DAMAGED);
    damaged[40] ^= 1;
    damaged[8] = 2;
    EXPECT(sateen_from_bytes(damaged, length, &table, message, sizeof message) == SATEEN_VERSION);
    free(damaged);

    EXPECT(sateen_from_file(path, &table, message, sizeof message) == SATEEN_OK && message[0] == 0);
    sateen_free(table);
    sateen_free(NULL);
}

static void queries(const sateen_table *table) {
    float albedo[3];
    size_t length = 1;
    EXPECT(sateen_thread_count(NULL) == 0 && sateen_thread_name(NULL, 0) == NULL);
    EXPECT(sateen_metadata(NULL, &length) != NULL && length == 0);
    EXPECT(sateen_decoded_bytes(NULL) == 0 && sateen_lent_bytes(NULL) == 0 && sateen_misses(NULL) == 0);
    sateen_reset_misses(NULL);
    EXPECT(sateen_thread_albedo(NULL, 0, albedo) == SATEEN_NULL_ARGUMENT);

    EXPECT(sateen_thread_count(table) == 2);
    EXPECT(strcmp(sateen_thread_name(table, 0), "warp") == 0 && strcmp(sateen_thread_name(table, 1), "weft") == 0);
    EXPECT(sateen_thread_name(table, 2) == NULL);
    EXPECT(sateen_thread_albedo(table, 2, albedo) == SATEEN_OUT_OF_RANGE);
    EXPECT(sateen_thread_albedo(table, 1, NULL) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_thread_albedo(table, 1, albedo) == SATEEN_OK && albedo[0] == 0.16f);
    EXPECT(strstr(sateen_metadata(table, NULL), "silk") != NULL);
    EXPECT(sateen_decoded_bytes(table) > 0 && sateen_misses(table) == 0);
    for (int status = -1; status < 20; ++status) {
        EXPECT(sateen_status_text(status)[0] != 0);
    }
    EXPECT(strcmp(sateen_status_text(SATEEN_OK), "ok") == 0 && sateen_version()[0] != 0);
}

static void lookups(const sateen_table *table) {
    const float wi[3] = {0.36f, 0.48f, 0.8f}, wr[3] = {-0.48f, -0.6f, 0.64f};
    float rgb[3], same[3];
    EXPECT(sateen_eval(NULL, wi, wr, rgb) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval(table, NULL, wr, rgb) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval(table, wi, NULL, rgb) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval(table, wi, wr, NULL) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval_with(table, NULL, 1, wi, wr, rgb) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval_with(table, wi, (size_t)-1, wi, wr, rgb) == SATEEN_INVALID_BUFFER);
    EXPECT(sateen_eval(table, wi, wr, rgb) == SATEEN_OK && rgb[0] > 0.0f);
    EXPECT(sateen_eval_cos(table, wi, wr, same) == SATEEN_OK);
    EXPECT(fabsf(same[0] - rgb[0] * wi[2]) <= 1e-6f * rgb[0]);
    float albedos[6];
    EXPECT(sateen_thread_albedo(table, 0, albedos) == SATEEN_OK);
    EXPECT(sateen_thread_albedo(table, 1, albedos + 3) == SATEEN_OK);
    EXPECT(sateen_eval_with(table, albedos, 2, wi, wr, same) == SATEEN_OK && memcmp(same, rgb, sizeof rgb) == 0);
    EXPECT(sateen_eval_with(table, albedos, 1, wi, wr, same) == SATEEN_OK && memcmp(same, rgb, sizeof rgb) == 0);
    const float nothing[3] = {NAN, INFINITY, NAN};
    EXPECT(sateen_eval(table, nothing, wr, rgb) == SATEEN_OK && rgb[0] == 0.0f);

    const float u[2] = {0.4f, 0.7f};
    sateen_sample sample;
    float density, seen[3];
    EXPECT(sateen_sample_cos(table, NULL, 0, wr, u, &sample) == SATEEN_OK && sample.pdf > 0.0f && sample.rho[0] > 0.0f);
    EXPECT(sateen_pdf(table, NULL, 0, sample.wi, wr, &density) == SATEEN_OK && density == sample.pdf);
    EXPECT(sateen_eval_cos(table, sample.wi, wr, rgb) == SATEEN_OK && rgb[2] == sample.rho[2]);
    EXPECT(sateen_sample_cos(table, albedos, 2, nothing, u, &sample) == SATEEN_OK && sample.pdf == 0.0f && sample.wi[2] == 0.0f);
    EXPECT(sateen_sample_cos(table, albedos, 2, wr, wr, &sample) == SATEEN_OK && sample.pdf == 0.0f);
    EXPECT(sateen_sample_cos(table, NULL, 0, wr, NULL, &sample) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_sample_cos(table, NULL, 0, wr, u, NULL) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_pdf(NULL, NULL, 0, wi, wr, &density) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_pdf(table, NULL, 0, NULL, wr, &density) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_pdf(table, NULL, 3, wi, wr, &density) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_has_sampling(NULL) == 0);
    /* These tables were baked without. */
    EXPECT(sateen_has_sampling(table) == 0 && sateen_albedo(table, NULL, 0, wr, seen) == SATEEN_NO_ALBEDO);

    enum { PAIRS = 19 };
    float *floats = malloc(9 * PAIRS * sizeof(float));
    EXPECT(floats != NULL);
    for (int pair = 0; pair < PAIRS; ++pair) {
        for (int k = 0; k < 3; ++k) {
            floats[k * PAIRS + pair] = wi[k];
            floats[(3 + k) * PAIRS + pair] = wr[k];
        }
    }
    const sateen_directions wis = {floats, floats + PAIRS, floats + 2 * PAIRS};
    const sateen_directions wrs = {floats + 3 * PAIRS, floats + 4 * PAIRS, floats + 5 * PAIRS};
    const sateen_colours out = {floats + 6 * PAIRS, floats + 7 * PAIRS, floats + 8 * PAIRS};
    EXPECT(sateen_eval_batch(table, PAIRS, wis, wrs, out) == SATEEN_OK && out.b[PAIRS - 1] > 0.0f);
    EXPECT(sateen_eval_cos_batch_with(table, albedos, 2, PAIRS, wis, wrs, out) == SATEEN_OK);
    EXPECT(sateen_eval_batch(NULL, PAIRS, wis, wrs, out) == SATEEN_NULL_ARGUMENT);
    const sateen_directions null_directions = {NULL, NULL, NULL};
    const sateen_colours null_colours = {NULL, NULL, NULL};
    EXPECT(sateen_eval_batch(table, 0, null_directions, null_directions, null_colours) == SATEEN_OK);
    EXPECT(sateen_eval_batch(table, 1, null_directions, wrs, out) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval_batch(table, 1, wis, wrs, null_colours) == SATEEN_NULL_ARGUMENT);
    EXPECT(sateen_eval_batch(table, (size_t)-1, wis, wrs, out) == SATEEN_INVALID_BUFFER);
    /* Ten pairs from each slice of nineteen: results that overlap one another, an input, or albedos. */
    const sateen_colours twice = {out.r, out.r + 9, out.b};
    EXPECT(sateen_eval_batch(table, 10, wis, wrs, twice) == SATEEN_INVALID_BUFFER);
    EXPECT(sateen_eval_batch(table, 9, wis, wrs, twice) == SATEEN_OK);
    const sateen_colours input = {floats + 3, out.g, out.b};
    EXPECT(sateen_eval_batch(table, 10, wis, wrs, input) == SATEEN_INVALID_BUFFER);
    EXPECT(sateen_eval_batch_with(table, out.r, 1, 10, wis, wrs, out) == SATEEN_INVALID_BUFFER);
    const sateen_colours beside = {(float *)(void *)((char *)out.r + 1), out.g, out.b};
    EXPECT(sateen_eval_batch(table, 10, wis, wrs, beside) == SATEEN_INVALID_BUFFER);
    free(floats);
}

int main(int argc, char **argv) {
    EXPECT(argc == 3);
    size_t length, compressed_length;
    unsigned char *bytes = read_file(argv[1], &length);
    unsigned char *compressed = read_file(argv[2], &compressed_length);
    prefixes(bytes, length);
    prefixes(compressed, compressed_length);
    loading(argv[2], compressed, compressed_length);

    sateen_table *table;
    EXPECT(sateen_from_mapped(bytes, length, &table, message, sizeof message) == SATEEN_OK);
    EXPECT(sateen_lent_bytes(table) == sateen_decoded_bytes(table));
    queries(table);
    lookups(table);
    sateen_free(table);
    free(bytes);

    EXPECT(sateen_from_bytes(compressed, compressed_length, &table, NULL, 0) == SATEEN_OK);
    free(compressed);
    EXPECT(sateen_lent_bytes(table) == 0);
    queries(table);
    lookups(table);
    sateen_free(table);
    return 0;
}
