/* The equations of motion, evaluated at a state. */
#ifndef PRBM_EVALUATION_H
#define PRBM_EVALUATION_H

#include "core/equations.h"
#include "core/evaluated.h"

PRBM void reference_place(Reference *reference, const System *system, Memory *memory);
PRBM void evaluation_place(Evaluation *evaluation, const System *system, Memory *memory);
PRBM void set_reference(Reference *reference, const System *system, const double *angle);
/* Compute the accelerations a (n,) and the multipliers lam (r,): forces of loops, of held stops
 * (> 0 pushes), of sticking contacts.  extra: the states of compliant stops, or NULL for zeros;
 * near: a reference near q, or NULL. */
PRBM bool evaluate_equations(const Equations *equations, double t, const double *q,
                             const double *v, const double *extra, const Reference *near,
                             Evaluation *result, Problem *problem);
/* Compute only the factors of the equations at a state. */
PRBM bool factor_equations(const Equations *equations, const double *q, const double *v,
                           const Reference *near, Evaluation *result, Problem *problem);
PRBM double kinetic_energy_of(const Evaluation *evaluation);
SHARED void directions_of(int even, const System *system, const Reference *near, Kinematics *at);
SHARED void arms_at(int even, const System *system, const Reference *near, Kinematics *at);
/* Compute the derivatives of the active rows by the directions, and their convective terms. */
PRBM void rows_and_convection(const Equations *eq, const Kinematics *at, double *rows,
                              double *convective);
/* Pull rows (r, wide) back to the coordinates, out (r, even). */
PRBM void rows_to_coordinates(const Equations *eq, const double *rows, double *out);
SHARED void rows_dispatch(int even, const Equations *eq, const Kinematics *at, double *rows,
                           double *convective);
SHARED bool motion_of_length(int even, const Equations *eq, const Reference *near,
                             Evaluation *result);
PRBM Kinematics place_kinematics(const System *system, Memory *memory);
PRBM void zero_placed(const Memory *memory, size_t begin);
PRBM void find_directions(const System *system, const Reference *near, Kinematics *at);

#endif
