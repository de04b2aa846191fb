/* sateen.h: fabric BRDFs from tables that sateen has baked, for C99 and C++.
 *
 * Frame       x is the warp's direction, y the weft's (as tangent and bitangent of the surface), z the normal. Directions are
 *             unit vectors that point away from the surface: wi to the light, wr to the viewer. Directions that are not above the
 *             surface (z <= 0), and those that are no numbers, give 0.
 * Values      Linear RGB in 1/sr, finite and never negative. sateen_eval is the BRDF without the cosine, sateen_eval_cos the BRDF
 *             times the cosine of the light. A table has no albedo in it: dyeing is an argument.
 * Threads     A table never changes, so that any number of threads may use it at the same time, without locks. (The count of misses
 *             is shared, and atomic.) Freeing it is for one of them, when no other uses it.
 * Errors      Functions return a status and touch their results only if it is SATEEN_OK; those that load say what is wrong, and
 *             where, in a buffer of the caller's. NULL, wrong lengths and damaged files are no crashes. What a function cannot know
 *             is yours: that a pointer leads to as much as is said here, and that a table has not been freed. Memory that cannot be
 *             had ends the program.
 * Lookups     allocate nothing. Batches are several times as fast as single pairs: ask for hundreds at a time.
 */
#ifndef SATEEN_H
#define SATEEN_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A loaded table. */
typedef struct sateen_table sateen_table;

typedef enum sateen_status {
    SATEEN_OK = 0,
    SATEEN_NULL_ARGUMENT = 1,  /* a pointer is null that must not be */
    SATEEN_INVALID_BUFFER = 2, /* results overlap other buffers; or one is not aligned for float, or longer than memory */
    SATEEN_OUT_OF_RANGE = 3,   /* there is no thread of this index */
    SATEEN_FILE = 4,           /* the file cannot be read */
    SATEEN_NOT_A_TABLE = 5,    /* some other kind of file */
    SATEEN_VERSION = 6,        /* of a format that this library does not read: upgrade, or bake again */
    SATEEN_LENGTH = 7,         /* it ends too soon, or bytes follow the end */
    SATEEN_DAMAGED = 8,        /* a checksum does not match */
    SATEEN_INVALID = 9,        /* a value contradicts the format */
    SATEEN_TOO_LARGE = 10,     /* would take more memory than allowed, 256 MiB of samples */
    SATEEN_NO_ZSTD = 11,       /* compressed, and the library was built without zstd */
    SATEEN_NO_ALBEDO = 12,     /* the table has no albedos by view: it was baked for some pairs, or with --no-sampling */
    SATEEN_INTERNAL = 13       /* a mistake in the library */
} sateen_status;

/* What a status means: English, never NULL. */
const char *sateen_status_text(int status);

/* The version of the library, as "0.1.0". */
const char *sateen_version(void);

/* Loading. All of it is checked: versions, checksums, sizes, ranges.
 *
 * `*table` becomes the table, or NULL. `message`, of `message_bytes` bytes, becomes a line of UTF-8 that ends with a zero and
 * says what is wrong, shortened if need be; an empty one if nothing is. It may be NULL. 200 bytes do, and the path's.
 */

/* From `length` bytes, which may be freed afterwards. */
sateen_status sateen_from_bytes(const void *bytes, size_t length, sateen_table **table, char *message, size_t message_bytes);

/* From a file; `path` as fopen takes it. */
sateen_status sateen_from_file(const char *path, sateen_table **table, char *message, size_t message_bytes);

/* From bytes that stay where they are, unchanged, until the table has been freed: a memory map, or data of the program. Samples
 * are not copied if the file was written by `sateen bake --stored` and `bytes` is a multiple of 4; else they are, and nothing
 * is different but memory: sateen_lent_bytes. */
sateen_status sateen_from_mapped(const void *bytes, size_t length, sateen_table **table, char *message, size_t message_bytes);

/* Frees it; NULL is nothing to free. */
void sateen_free(sateen_table *table);

/* What a table is. Of NULL: 0, NULL, or an empty text. */

/* Number of threads (of the cloth). */
size_t sateen_thread_count(const sateen_table *table);

/* The name of a thread: "warp", "weft", ...; NULL if there is none. It is there as long as the table. */
const char *sateen_thread_name(const sateen_table *table, size_t thread);

/* The fabric's own albedo of a thread, three floats. */
sateen_status sateen_thread_albedo(const sateen_table *table, size_t thread, float *albedo);

/* TOML that says what made the table; `*length` becomes its length (no zero follows), unless it is NULL. It is there as long as
 * the table. */
const char *sateen_metadata(const sateen_table *table, size_t *length);

/* Bytes of samples in memory, and how many of them were not copied from the file's. */
size_t sateen_decoded_bytes(const sateen_table *table);
size_t sateen_lent_bytes(const sateen_table *table);

/* How many pairs were looked up that the table was not baked for, since it was loaded or this was reset: they got the nearest value
 * that there is. Always 0 for tables of everything. */
size_t sateen_misses(const sateen_table *table);
void sateen_reset_misses(const sateen_table *table);

/* One pair: `wi`, `wr` and the result are three floats each. `albedos` are three floats for each of `albedo_count` threads, in
 * the order of the table; threads beyond have the fabric's own. NULL and 0: all have. */
sateen_status sateen_eval(const sateen_table *table, const float *wi, const float *wr, float *brdf);
sateen_status sateen_eval_cos(const sateen_table *table, const float *wi, const float *wr, float *rho);
sateen_status sateen_eval_with(const sateen_table *table, const float *albedos, size_t albedo_count, const float *wi,
                               const float *wr, float *brdf);
sateen_status sateen_eval_cos_with(const sateen_table *table, const float *albedos, size_t albedo_count, const float *wi,
                                   const float *wr, float *rho);

/* Drawing of directions, for path tracers: the viewer wr is known, a light is sought. Albedos of threads are as before. */

/* A direction that has been drawn. `rho` / `pdf` is what the light from `wi` counts. */
typedef struct sateen_sample {
    float wi[3];
    float rho[3]; /* BRDF times cosine */
    float pdf;    /* per steradian; 0, and all else, too: there is no sample */
} sateen_sample;

/* 1 if the table knows where its light comes from. Else directions are drawn by the cosine. */
int sateen_has_sampling(const sateen_table *table);

/* A direction for the view, by two numbers `u` from 0 to below 1. No sample where wr is not above the surface, or u is out of range. */
sateen_status sateen_sample_cos(const sateen_table *table, const float *albedos, size_t albedo_count, const float *wr,
                                const float *u, sateen_sample *sample);

/* The density per steradian of sateen_sample_cos to draw wi; 0 where a direction is not above the surface. */
sateen_status sateen_pdf(const sateen_table *table, const float *albedos, size_t albedo_count, const float *wi, const float *wr,
                         float *pdf);

/* What is reflected to the view of white light from everywhere, three floats. */
sateen_status sateen_albedo(const sateen_table *table, const float *albedos, size_t albedo_count, const float *wr, float *albedo);

/* Many directions: as many floats of x, of y and of z as there are pairs. */
typedef struct sateen_directions {
    const float *x;
    const float *y;
    const float *z;
} sateen_directions;

/* As many of red, of green and of blue. */
typedef struct sateen_colours {
    float *r;
    float *g;
    float *b;
} sateen_colours;

/* Many pairs, with the widest vector instructions of the machine. A value differs from that of a single pair by rounding alone,
 * and does not depend on its neighbours. Slices that are written overlap no others. */
sateen_status sateen_eval_batch(const sateen_table *table, size_t pairs, sateen_directions wi, sateen_directions wr,
                                sateen_colours brdf);
sateen_status sateen_eval_cos_batch(const sateen_table *table, size_t pairs, sateen_directions wi, sateen_directions wr,
                                    sateen_colours rho);
sateen_status sateen_eval_batch_with(const sateen_table *table, const float *albedos, size_t albedo_count, size_t pairs,
                                     sateen_directions wi, sateen_directions wr, sateen_colours brdf);
sateen_status sateen_eval_cos_batch_with(const sateen_table *table, const float *albedos, size_t albedo_count, size_t pairs,
                                         sateen_directions wi, sateen_directions wr, sateen_colours rho);

#ifdef __cplusplus
}
#endif

#endif
