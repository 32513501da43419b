/* Elements with energy: flexures, torsion at joints, and springs between points.  Statics, modes,
 * the equations of motion, scales and the stable step read the sum of all. */
#ifndef PRBM_ELEMENTS_H
#define PRBM_ELEMENTS_H

#include "core/system.h"

/* A spring in one shape: the vector from its start to its end [m], its length and elongation [m], and
 * its elastic force, positive in tension [N]. */
typedef struct {
    Complex along;
    double length, elongation, tension;
} SpringState;

/* Return the change of the rotation of a torsion for changes x (n,) of the coordinates. */
PRBM double turn_of(const Torsion *torsion, const double *x);
/* Return its rotation from that without a moment, with a share of its free angle [rad]. */
PRBM double twist_of(const System *system, const Torsion *torsion, const double *q, double share);
/* Add a moment against its rotation to force (n,). */
PRBM void turn_back(const Torsion *torsion, double moment, double *force);

/* The force with which a spring acts on its side, and a fraction of its parts, its round-off [N]. */
typedef struct {
    double force, rounding;
} CoilPull;

PRBM double spring_tension(const SpringLaw *law, double x);
PRBM double spring_slope(const SpringLaw *law, double x);
PRBM double spring_energy(const SpringLaw *law, double x);
/* Return a vector and the length of a spring with a share of its pretension. */
PRBM SpringState spring_state(const System *system, int k, const Complex *e, double share);
/* The law without its side. */
PRBM SpringLaw two_sided(const SpringLaw *law);
/* Return the elastic force of a spring in its phase, and its force with that of damping. */
PRBM double coil_elastic(const SpringLaw *law, const SpringState *now, SpringPhase phase);
PRBM double coil_force(const SpringLaw *law, const SpringState *now, double rate, SpringPhase phase);
/* Return the rate of the length of spring k. */
PRBM double length_rate(const System *system, int k, const SpringState *now, const Complex *e,
                        const double *v);
/* Return the elongation of spring k to the side on which it acts, its rate, and its force. */
PRBM double strain_of(const System *system, int k, const Complex *e);
PRBM double strain_rate_of(const System *system, int k, const Complex *e, const double *v);
/* Return the round-off of the length of a spring [m], and that of its rate [m/s]. */
PRBM double coil_near(const System *system);
PRBM double coil_slow(const System *system, const double *v);
PRBM CoilPull coil_pull(const System *system, int k, const Complex *e, const double *v);
/* Return the phase of spring k.  phases (coils,): of all springs, if one acts on one side. */
PRBM SpringPhase coil_phase(const System *system, const SpringPhase *phases, int k);
/* Set row (n,) to the derivatives of the displacement of the end of spring k relative to its start,
 * along a vector u: dz.u, with the unit vector along the spring those of its length. */
PRBM void span_gradient(const System *system, int k, Complex u, const Complex *e, double *row);
/* Set row (n,) to the derivatives of the length of spring k. */
PRBM void length_gradient(const System *system, int k, const Complex *e, double *row);

/* Add the forces of torsion and springs with their damping to force (n,), and return the power that
 * they dissipate.  row (n,) is working memory. */
PRBM double add_motion_forces(const System *system, const SpringPhase *phases, double beta,
                              const double *q, const Complex *e, const double *v, double *force,
                              double *row);
/* Return the number of dampers, whose damping is not in proportion to stiffness. */
PRBM int damper_count(const System *system);
/* Return the coefficient of damper k, and set row (n,) to the derivatives of its length or rotation. */
PRBM double damper_row(const System *system, int k, const Complex *e, double *row);

/* Return whether initial strains, free angles or the pretension of springs load the drawn shape. */
PRBM bool element_strained(const System *system);
/* Compute the elastic forces (n,) of all elements along the coordinates.  share: that of the initial
 * strains, of the free angles and of the pretension of springs. */
PRBM void element_forces(const System *system, const double *q, const Complex *e, double share,
                         double *force, Scratch scratch);
/* Set K_t (n, n) to minus the derivatives of these forces. */
PRBM void element_tangent(const System *system, const Complex *e, double share, double *K_t,
                          Scratch scratch);
PRBM double element_energy(const System *system, const double *q, const Complex *e,
                           Scratch scratch);
/* Set K (n, n) to the stiffness without negative parts. */
PRBM void element_stiffness(const System *system, const Complex *e, double *K, Scratch scratch);
/* Set torques (n,) to the product of this stiffness and w (n,); row (n,) is working memory. */
PRBM void element_torques(const System *system, const Complex *e, const double *w, double *torques,
                          double *row);
/* Add an element of the stiffness of the directions i and j to that of the coordinates K_t (n, n). */
PRBM void stiffen(const System *system, int i, int j, double x, double *K_t);
/* Add the stiffness by forces that act on arms to K_t (n, n): pull (d,) of each arm, see the twin. */
PRBM void add_geometric_stiffness(const System *system, const Complex *pull, double *K_t);

#endif
