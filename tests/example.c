/* The library from outside: compiled by test_install against an installed relit, it processes a frame that
 * was made in memory and prints the colour of its middle pixel. */
#include <graph/relit.h>
#include <stdio.h>
#include <stdlib.h>

enum { W = 96, H = 64 };

static const char pipeline[] =
    "relit: 1\n"
    "capture:\n"
    "  relit_capture: 1\n"
    "  name: made\n"
    "  files: memory\n"
    "  unit: m\n"
    "  camera: {matrix: header, forward: -z, fov_x: header, jitter: [0, 0]}\n"
    "  layers:\n"
    "    albedo: {channels: [R, G, B], colorspace: lin_rec709}\n"
    "    normal: {channels: [NX, NY, NZ], space: world, encoding: signed}\n"
    "    depth: {channels: [Z], kind: planar, empty: 1e10}\n"
    "    stencil: {channels: [ID]}\n"
    "materials: {default: {}}\n"
    "shading: {diffuse: lambert, specular: none}\n"
    "lights: {sun: {type: directional, direction: [0, 0, -1], irradiance: 3.14159265}}\n"
    "graph: {light: {pass: lighting}, c: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}}\n"
    "outputs: {o: {image: c.color, file: 'o.{frame}.exr'}}\n";

static float plane[8][W * H];
static uint32_t ids[W * H];

int main(void)
{
    for (int i = 0; i < W * H; i++) {
        plane[0][i] = 0.8f; /* albedo */
        plane[1][i] = 0.5f;
        plane[2][i] = 0.4f;
        plane[5][i] = 1; /* the normal's z: towards the camera */
        plane[6][i] = 2; /* depth */
        ids[i] = 7;
    }
    const char *names[] = {"R", "G", "B", "NX", "NY", "NZ", "Z"};
    rl_channel_data channels[8];
    for (int i = 0; i < 7; i++)
        channels[i] = (rl_channel_data){.name = names[i], .floats = plane[i], .stride = W};
    channels[7] = (rl_channel_data){.name = "ID", .ids = ids, .stride = W};
    rl_frame_data frame = {.width = W,
                           .height = H,
                           .channels = channels,
                           .n_channels = 8,
                           .world_to_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                           .fov_x = 0.6};
    rl_options options = {.pipeline_text = pipeline};
    rl_session *session = NULL;
    rl_error err = {0};
    rl_image_view image;
    if (rl_session_open(&options, &session, &err) || rl_session_process(session, 0, 1, &frame, &err) ||
        rl_session_image(session, "c.color", &image, &err)) {
        fprintf(stderr, "%s:%d: %s\n", err.file, err.line, err.text);
        rl_session_close(&session);
        return EXIT_FAILURE;
    }
    size_t middle = (size_t)(H / 2) * image.stride + W / 2;
    printf("%s %dx%d %.4f %.4f %.4f\n", image.format, image.width, image.height,
           (double)image.plane[0][middle], (double)image.plane[1][middle], (double)image.plane[2][middle]);
    rl_session_close(&session);
    return EXIT_SUCCESS;
}
