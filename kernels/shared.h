/* What the host and the kernels both know. Compiles as C11 and as OpenCL C 1.2: only 4-byte scalars and
 * arrays of them, so that the layout is the same everywhere.
 *
 * Buffers and pixels. A frame's data window is placed in buffers whose left edge lies on a multiple of 64 and
 * whose top edge on a multiple of 4 in display-window pixels; `columns` is a multiple of 64, `rows` of 4. So
 * a vector of pixels is the same vector whatever the crop. Kernels work in buffer coordinates; x + origin[0],
 * y + origin[1] are display-window pixels. Outside of the valid rectangle stencil = 0, depth = 0 and every
 * other layer is 0.
 *
 * RL_LINEAR: pixel (x, y) of plane p is at p*plane + y*stride + x. RL_GUARD floats before and behind the
 * image can be read (not written), so that unaligned vectors one pixel off stay inside.
 *
 * RL_PHASE4: pixel (x, y) is in sub-image s = (y&3)*4 + (x&3), at
 * p*plane4 + (s*(rows/4) + y/4)*stride4 + RL_MARGIN4 + x/4. The RL_MARGIN4 elements on both sides of a
 * sub-row can be read; in the stencil they are 0. */
#ifndef RL_SHARED_H
#define RL_SHARED_H

#define RL_GUARD   128
#define RL_MARGIN4 16

/* A frame's sums (RL_SUMS), of a REDUCTION port. Rows are cut into RL_BANDS bands of equal height, whose sums
 * are apart, so that they are the same bits in whatever order the bands are done. Value v of material m in
 * band b is the sum of two floats, the large one first, at 2*((b*RL_SUM_MATERIALS + m)*RL_SUM_VALUES + v).
 * Entries of materials that the frame does not have are undefined. */
#define RL_BANDS         32
#define RL_SUM_MATERIALS 256
#define RL_SUM_VALUES    19
#define RL_SUM_FLOATS    (2 * RL_BANDS * RL_SUM_MATERIALS * RL_SUM_VALUES)

/* The ledger of energy: values of its sums, each a channel at i, i+1, i+2; then the number of pixels. */
enum {
    ENERGY_IN = 0,
    ENERGY_OUT = 3,
    ENERGY_BORDER = 6,
    ENERGY_OFF_SCREEN = 9,
    ENERGY_CLAMPED = 12,
    ENERGY_REDISTRIBUTED = 15,
    ENERGY_PIXELS = 18
};

/* x right, y down in pixels; view space is right-handed, +x right, +y up, looks down -z; metres. The sample
 * of pixel (x, y) lies at display position (x + 0.5 + jitter[0], y + 0.5 + jitter[1]) and view = ((px -
 * centre[0]) / focal[0] * depth, -(py - centre[1]) / focal[1] * depth, -depth). */
typedef struct camera_t {
    float to_view[12];  /* 3 rows of 4, column vectors: view = M * (world, 1) */
    float to_world[12]; /* its inverse */
    float focal[2];     /* pixels, > 0 */
    float centre[2];    /* principal point, display-window pixels */
    float jitter[2];    /* pixels */
} camera_t;

typedef struct frame_t {
    int columns, rows;   /* of the buffers */
    int valid[4];        /* x0, y0, x1, y1 in buffer coordinates, x1 and y1 exclusive */
    int origin[2];       /* display-window pixel of buffer pixel (0, 0) */
    int stride, plane;   /* RL_LINEAR: floats from row to row, from plane to plane */
    int stride4, plane4; /* RL_PHASE4: floats from sub-row to sub-row, from plane to plane */
    int number;          /* absolute frame number */
    int history;         /* 1: history ports hold the frame before; 0: they hold nothing */
    int materials;       /* entries of the material table, the empty one included */
    int lights;          /* entries of the light table */
    camera_t camera;
    camera_t previous; /* of the frame that history holds */
} frame_t;

enum { LIGHT_POINT = 0, LIGHT_SPOT = 1, LIGHT_DIRECTIONAL = 2, LIGHT_SPHERE = 3, LIGHT_RECT = 4 };
enum { SHADOW_MARCH = -2 }; /* light_t.shadow: visibility is to be found in the depth buffer */

typedef struct light_t {
    int type;
    float position[3];          /* world, metres; of area lights the middle */
    float direction[3];         /* world, unit: where the light travels */
    float intensity[3];         /* W/sr, of a rect along its direction; directional: W/m2; working space */
    float cos_inner, cos_outer; /* spot: full inside, none outside (cosines of half angles) */
    int shadow;                 /* plane of the shadow port, -1: visibility is 1, SHADOW_MARCH */
    int shadow_thickness;       /* plane of the shadow_thickness port, -1: 0 */
    float radius;               /* metres; of a rect to its corners */
    float radiance;             /* area lights: of an intensity of 1, 1/m2 */
    float side[3], top[3]; /* rect: half axes, metres, side x top along direction; others: unit, directions of
                              a profile's horizontal angles 90 and 0 */
    int two_sided;         /* rect */
    int profile;           /* where its table is in the profiles, 0 = none */
} light_t;

/* A profile: how an intensity changes with direction, 0 to 1. Two numbers, v and h, then v rows of h values:
 * row i for an angle pi i/(v-1) off the light's direction, column j for 2 pi j/(h-1) around it; h = 1: the
 * same all around. The buffer of all profiles begins with a number that is none's. */

/* Tables of the lighting pass (passes/ltc_table.h): rows of roughness i/31, of n.v = 1 - (j/31)^2. */
#define RL_LTC_SIDE   32
#define RL_LTC_VALUES 8

/* Light from everywhere, without shadows; radiance in the working space, directions in world space. */
#define RL_LOBES      16
#define RL_SKY_LEVELS 11
typedef struct lobe_t { /* a spherical Gaussian */
    float axis[3];      /* unit, towards the light */
    float sharpness;    /* 1e-3 to 1e4 */
    float flux[3];      /* its integral over all directions */
} lobe_t;

typedef struct ambient_t {
    int on; /* 0: no light, nothing else is looked at */
    int lobes;
    float sh[27]; /* coefficient i of channel c at 3 i + c; real orthonormal harmonics, 1 y z x xy yz zz xz
                     xx-yy */
    lobe_t lobe[RL_LOBES];
    int sky_levels; /* of the sky's mirror images, 0 = none */
    int sky_side[RL_SKY_LEVELS];
    int sky_at[RL_SKY_LEVELS];
} ambient_t;

/* The sky's buffer: level i is what a surface of perceptual roughness i/(sky_levels-1) reflects, an
 * octahedral image of sky_side[i] pixels with a border of one that repeats what is across the edge, RGB and
 * an unused number a pixel, from float sky_at[i] on. */

#endif
