/* Arithmetic that C does not have as JAX does it. Included before the translated functions. */

#ifndef DT_ARITHMETIC_H
#define DT_ARITHMETIC_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__GNUC__)
#define DT_UNUSED __attribute__((unused))
#else
#define DT_UNUSED
#endif

/* What is not a number stays so, where fmax and fmin would drop it. */
DT_UNUSED static double dt_max(double a, double b)
{
    return a != a || a > b ? a : b;
}

DT_UNUSED static double dt_min(double a, double b)
{
    return a != a || a < b ? a : b;
}

/* Zero keeps its sign, and what is not a number stays so. */
DT_UNUSED static double dt_sign(double a)
{
    return a > 0 ? 1.0 : a < 0 ? -1.0 : a;
}

/* By repeated squaring, as XLA multiplies, so that the last digits agree. */
DT_UNUSED static double dt_integer_pow(double a, int power)
{
    double result = 1.0;
    for (int rest = power < 0 ? -power : power; rest > 0; rest >>= 1) {
        if (rest & 1) result *= a;
        a *= a;
    }
    return power < 0 ? 1.0 / result : result;
}

/* Numbers beyond the range of integers end at its bounds; C leaves open what they become. */
DT_UNUSED static int64_t dt_whole(double a)
{
    if (a != a) return 0;
    if (a >= 9223372036854775807.0) return INT64_MAX;
    if (a <= -9223372036854775808.0) return INT64_MIN;
    return (int64_t)a;
}

/* A position within 0 to the last one that has room. */
DT_UNUSED static int64_t dt_within(int64_t position, int64_t last)
{
    return position < 0 ? 0 : position > last ? last : position;
}

DT_UNUSED static uint64_t dt_bits(double a)
{
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    return bits;
}

DT_UNUSED static double dt_from_bits(uint64_t bits)
{
    double a;
    memcpy(&a, &bits, sizeof a);
    return a;
}

#endif
