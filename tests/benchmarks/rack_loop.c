/* The rack-and-pinion case as a plain loop of constant steps, one variant after another.
 *
 * State, parameters and constants are those of rack_case.py, in its order. */
#include <math.h>

enum { STATES = 8, VALUES = 20 };

static const double RADIUS = 0.08488 / 2 / 16;
static const double VISCOUS = 4e-4, MOTOR_WIDTH = 0.2, TABLE_WIDTH = 5e-4;
static const double FORCE_WIDTH = 1.0, CONTACT_WIDTH = 1e-7;
static const double POSITION_GAIN = 25.0, VELOCITY_GAIN = 700.0, RESET = 0.02, PRELOAD_GAIN = 5e-4, AHEAD = 3.3;
static const double LIMIT = 30.0, ROUNDING = 0.03;

typedef struct {
    double scale, exponent, width_squared, d1, d2, d3, half, inverse_inertia, coulomb;
} Train;

typedef struct {
    Train train[2];
    double inverse_mass, coulomb, viscous, preload;
} Given;

static Given constants(const double *p) {
    Given g;
    for (int i = 0; i < 2; i++, p += 8) {
        const double slope = 1 - 1 / p[1], power = 1 / slope;
        const double width = pow(FORCE_WIDTH, slope) / (p[0] * pow(slope, p[1]));
        g.train[i] = (Train){pow(p[0] * slope, power), (power - 1) / 2, width * width, p[2], p[3], p[4], p[5] / 2,
                             1 / p[6], p[7]};
    }
    g.inverse_mass = 1 / p[0];
    g.coulomb = p[1];
    g.viscous = p[2];
    g.preload = p[3];
    return g;
}

static inline double size(double x, double width) { return sqrt(x * x + width * width); }

static inline double clipped(double x) { return 2 * LIMIT * x / (size(x + LIMIT, ROUNDING) + size(x - LIMIT, ROUNDING)); }

static inline double mesh(double deflection, double closing, const Train *g) {
    const double above = deflection - g->half, below = deflection + g->half;
    const double upper = size(above, CONTACT_WIDTH), lower = size(below, CONTACT_WIDTH);
    const double indentation = deflection * (1 - 2 * g->half / (upper + lower));
    const double contact = 1 + above / (2 * upper) - below / (2 * lower);
    const double reach = indentation * indentation + g->width_squared;
    const double elastic = contact * g->scale * pow(reach, g->exponent) * indentation;
    return elastic + (g->d1 / (g->d2 + size(elastic, FORCE_WIDTH)) + g->d3) * contact * closing;
}

/* Torques asked for, and velocity errors. */
static inline void cascade(const double *y, const double *wanted, double preload, double *asked, double *error) {
    const double common = POSITION_GAIN * (wanted[0] - y[2]) + wanted[1];
    double torque[2];
    for (int i = 0; i < 2; i++) {
        error[i] = common - RADIUS * y[3 + i];
        torque[i] = VELOCITY_GAIN * error[i] + y[6 + i] + AHEAD * wanted[2];
    }
    const double extra = PRELOAD_GAIN * (preload - (torque[0] - torque[1]) / 2) / (1 + PRELOAD_GAIN * VELOCITY_GAIN);
    asked[0] = torque[0] + VELOCITY_GAIN * extra;
    asked[1] = torque[1] - VELOCITY_GAIN * extra;
    error[0] += extra;
    error[1] -= extra;
}

static inline void rate(const double *restrict y, const double *restrict wanted, const Given *restrict g,
                        double *restrict dy) {
    double asked[2], error[2], forces = 0;
    cascade(y, wanted, g->preload, asked, error);
    for (int i = 0; i < 2; i++) {
        const Train *train = &g->train[i];
        const double speed = y[3 + i], limited = clipped(asked[i]);
        const double force = mesh(RADIUS * y[i] - y[2], RADIUS * speed - y[5], train);
        const double lost = train->coulomb * speed / size(speed, MOTOR_WIDTH) + VISCOUS * speed;
        dy[i] = speed;
        dy[3 + i] = (clipped(limited) - lost - RADIUS * force) * train->inverse_inertia;
        dy[6 + i] = (VELOCITY_GAIN * error[i] + limited - asked[i]) / RESET;
        forces += force;
    }
    dy[2] = y[5];
    dy[5] = (forces - g->coulomb * y[5] / size(y[5], TABLE_WIDTH) - g->viscous * y[5]) * g->inverse_mass;
}

/* Classical Runge-Kutta of fourth order; `wanted` holds begin, middle and end. */
static inline void step(double *restrict y, double h, const double *restrict wanted, const Given *restrict g) {
    double a[STATES], b[STATES], c[STATES], d[STATES], z[STATES];
    rate(y, wanted, g, a);
    for (int i = 0; i < STATES; i++) z[i] = y[i] + h / 2 * a[i];
    rate(z, wanted + 3, g, b);
    for (int i = 0; i < STATES; i++) z[i] = y[i] + h / 2 * b[i];
    rate(z, wanted + 3, g, c);
    for (int i = 0; i < STATES; i++) z[i] = y[i] + h * c[i];
    rate(z, wanted + 6, g, d);
    for (int i = 0; i < STATES; i++) y[i] += h / 6 * (a[i] + 2 * (b[i] + c[i]) + d[i]);
}

/* Right-hand side at one state, for the comparison of equations. */
void right_hand_side(const double *y, const double *wanted, const double *values, double *dy) {
    const Given g = constants(values);
    rate(y, wanted, &g, dy);
}

/* Table position and both torques at all saved times, shape (variants, saves + 1, 3); `wanted` holds position, velocity
 * and acceleration at half steps, shape (2·saves·substeps + 1, 3). */
void simulate(int variants, int saves, int substeps, double h, const double *wanted, const double *values,
              double *result) {
    for (int v = 0; v < variants; v++, values += VALUES) {
        const Given g = constants(values);
        double y[STATES] = {0}, asked[2], error[2];
        const double *at = wanted;
        for (int s = 0; s <= saves; s++) {
            cascade(y, at, g.preload, asked, error);
            *result++ = y[2];
            *result++ = clipped(clipped(asked[0]));
            *result++ = clipped(clipped(asked[1]));
            for (int i = 0; s < saves && i < substeps; i++, at += 6) step(y, h, at, &g);
        }
    }
}
