/* The per-pixel kernel of Golubev's talk (SIGGRAPH 2018), written down straightforwardly: a work-item a
 * pixel, taps from a table, turned by a random angle, gathered from planes, bilateral weights R(sqrt(r² +
 * dz²))/p(r). The same filter as sss_burley with `orientation: screen`, `weighting: plain`, `border:
 * renormalize`; what that is measured against. Built by tests/bench_sss.c with WIDTH, HEIGHT, TAPS, FOCAL_X,
 * FOCAL_Y and the ray's constants defined. */

typedef struct peer_material {
    int has_profile;
    float d[3]; /* metres */
    int pre_post, disney;
} peer_material;

kernel void talk_sss(global const float *diffuse, global const float *lit, global const float *albedo,
                     global const float *normal, global const float *depth, global const uint *stencil,
                     global float *color, constant float *taps, constant peer_material *materials,
                     constant float *to_world)
{
    const int plane = WIDTH * HEIGHT;
    int x = get_global_id(0), y = get_global_id(1), at = y * WIDTH + x;
    uint id = stencil[at];
    if (!materials[id].has_profile) {
        for (int c = 0; c < 3; c++)
            color[c * plane + at] = lit[c * plane + at];
        return;
    }
    constant peer_material *m = &materials[id];
    float z = depth[at], most = fmax(m->d[0], fmax(m->d[1], m->d[2]));
    uint h = (uint)(x * 1973 + y * 9277) * 26699u;
    h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
    float angle = (float)((h ^ (h >> 13)) & 0xffffu) * (6.28318531f / 65536.0f);
    float si = sin(angle), co = cos(angle);
    float3 sum = 0.0f, total = 0.0f, s = (float3)(1.0f / m->d[0], 1.0f / m->d[1], 1.0f / m->d[2]);
    for (int i = 0; i < TAPS; i++) {
        float u = taps[3 * i] * most, v = taps[3 * i + 1] * most;
        int px = x + (int)rint((u * co - v * si) * FOCAL_X / z),
            py = y + (int)rint((u * si + v * co) * FOCAL_Y / z);
        if (px < 0 || py < 0 || px >= WIDTH || py >= HEIGHT)
            continue;
        int there = py * WIDTH + px;
        if (stencil[there] != id)
            continue;
        float dz = depth[there] - z, r = sqrt(u * u + v * v + dz * dz);
        float3 w = (exp(-s * r) + exp(-s * r * (1.0f / 3.0f))) * s * (taps[3 * i + 2] / r);
        sum += w * (float3)(diffuse[there], diffuse[plane + there], diffuse[2 * plane + there]);
        total += w;
    }
    float3 own = (float3)(diffuse[at], diffuse[plane + at], diffuse[2 * plane + at]);
    float3 a = (float3)(albedo[at], albedo[plane + at], albedo[2 * plane + at]);
    a = m->pre_post ? sqrt(a) : a;
    float out = 1.0f;
    if (m->disney) {
        float3 ray = (float3)(((float)x + RAY_X) / FOCAL_X, -((float)y + RAY_Y) / FOCAL_Y, -1.0f);
        float3 n = (float3)(normal[at], normal[plane + at], normal[2 * plane + at]);
        float3 w = (float3)(to_world[0] * ray.x + to_world[1] * ray.y + to_world[2] * ray.z,
                            to_world[4] * ray.x + to_world[5] * ray.y + to_world[6] * ray.z,
                            to_world[8] * ray.x + to_world[9] * ray.y + to_world[10] * ray.z);
        float q = 1.0f - fmin(fabs(dot(n, w)) * rsqrt(dot(ray, ray)), 1.0f);
        out = 1.0f - 0.5f * q * q * q * q * q;
    }
    float3 light = select(own, sum / total, total > 0.0f) * a * out;
    color[at] = lit[at] + light.x;
    color[plane + at] = lit[plane + at] + light.y;
    color[2 * plane + at] = lit[2 * plane + at] + light.z;
}
