/* Which pattern of taps a pixel takes: what changes from phase to phase of RL_PHASE4 and from frame to frame.
 */

enum { ROTATION_NONE = 0, ROTATION_WHITE = 1, ROTATION_IGN = 2, ROTATION_BLUE = 3 };

/* What tells the pattern of a phase in a frame from the others: its turn (x) and the offset of its radii (y),
 * as shares of 2³². A turn alone does not do: the radii would stay where they are, and a few turns of one
 * spiral leave rings.
 *
 * BLUE takes the points of R2 (Roberts 2018: multiples of 1/g and 1/g², g³ = g + 1), which fill the square
 * of turns and offsets evenly from any point on. Frames follow each other, phases are sixteen points apart;
 * the order of phases is the one of which 2x2 neighbours err least together.
 * IGN is interleaved gradient noise (Jimenez 2014), a frame 5.588238 pixels on, for the offsets transposed.
 *
 * RMS error against sss_reference on two captured heads, beside that of WHITE. One frame: the same, but of
 * the means of 4x4 pixels 0.74 to 0.83 (BLUE), 0.83 to 0.86 (IGN). The mean of 8 frames: 0.80 to 0.84 (BLUE),
 * 1.2 to 1.3 (IGN); of 16 frames: 0.78 (BLUE), 1.1 to 1.3 (IGN). */
static inline uint2 pattern_choice(int rotation, int seed, int number, int px, int py)
{
    const uint order[16] = {2, 3, 12, 6, 14, 8, 4, 10, 1, 11, 0, 5, 15, 7, 13, 9};
    uint x = px, y = py, k = (uint)number + 16 * order[4 * py + px];
    uint2 choice;
    if (rotation == ROTATION_NONE)
        return (uint2)(0, 0x80000000u);
    if (rotation == ROTATION_WHITE)
        return (uint2)(rl_hash((uint)seed, (uint)number, 4 * y + x, 1),
                       rl_hash((uint)seed, (uint)number, 4 * y + x, 2));
    if (rotation == ROTATION_IGN) { /* fractions of 2³²: 0.06711056, 0.00583715, their sum times 5.588238 */
        uint frame = (uint)number * 1750839832u;
        choice = (uint2)(288237660u * x + 25070368u * y, 25070368u * x + 288237660u * y) + frame;
        choice = 52u * choice + mul_hi(choice, (uint2)(4221604530u)); /* 52.9829189 */
    } else {
        choice = (uint2)(2447445414u, 3242174889u) * k;
    }
    return choice + (uint2)(rl_hash((uint)seed, 0, 0, 1), rl_hash((uint)seed, 0, 0, 2));
}
