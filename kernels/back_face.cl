/* In front of the shared shading code when it lights back faces: there is no scattering in the lighting, and no layer of a
 * back face's own but albedo and normal. */
#define HAS_curvature     0
#define HAS_smooth_normal 0
