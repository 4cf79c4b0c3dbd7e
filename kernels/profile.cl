/* Lamps' profiles. Behind surface.cl. */

#if LIGHTS_PROFILE
/* A lamp's profile (IES LM-63) in the direction of the surface, bilinear. kernels/shared.h has the table's layout. */
static inline floatv profile_at(global const float *profiles, constant light_t *light, const floatv *l)
{
    global const float *table = profiles + light->profile;
    int rows = (int)table[0], columns = (int)table[1];
    floatv down = 0.0f, side = 0.0f, top = 0.0f;
    float row[RL_W], column[RL_W], out[RL_W];
    for (int i = 0; i < 3; i++) {
        down = fma(-l[i], light->direction[i], down);
        side = fma(-l[i], light->side[i], side);
        top = fma(-l[i], light->top[i], top);
    }
    floatv around = atan2(side, top) * (0.5f / RL_PI);
    rl_vstore(atan2(sqrt(fma(side, side, top * top)), down) * ((float)(rows - 1) / RL_PI), 0, row);
    rl_vstore((around - floor(around)) * (float)(columns - 1), 0, column);
    for (int i = 0; i < RL_W; i++) {
        int r = clamp((int)row[i], 0, rows - 2), c = clamp((int)column[i], 0, max(columns - 2, 0)), next = min(columns - 1, 1);
        global const float *at = table + 2 + r * columns + c;
        float s = column[i] - (float)c;
        out[i] = mix(mix(at[0], at[next], s), mix(at[columns], at[columns + next], s), clamp(row[i] - (float)r, 0.0f, 1.0f));
    }
    return rl_vload(0, out);
}
#endif
