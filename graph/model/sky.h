/* What rough surfaces mirror of an HDRI: images of it, blurred by GGX for one roughness each (Karis 2013),
 * that the lighting pass looks up (ambient_t in kernels/shared.h).
 *
 * The lobe is taken as seen from along its own axis (n = v = r), so that an image depends on the mirror
 * direction alone. Each pixel is a sum of 256 to 1024 directions of the lobe, each read from the mip level
 * that its share of the lobe covers (Krivanek and Colbert 2008). Level 0 (roughness 0) is the map itself. */
#ifndef RL_MODEL_SKY_H
#define RL_MODEL_SKY_H

#include "graph/base/pool.h"
#include "graph/model/ambient.h"
#include "kernels/shared.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_sky {
    float *data; /* owned: free with rl_free */
    size_t n;    /* floats */
    int side[RL_SKY_LEVELS], at[RL_SKY_LEVELS];
} rl_sky;

/* `plane`, width, height: as for rl_ambient_project; samples that are not finite count as 0. `to_working`: a
 * matrix for every pixel, rows listed. The same bits for every number of threads. About 1.5 s of processor
 * time for 1024 x 512. */
rl_code rl_sky_make(const rl_ambient *a, const float *const plane[3], int width, int height,
                    const float to_working[9], rl_pool *pool, rl_sky *out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
