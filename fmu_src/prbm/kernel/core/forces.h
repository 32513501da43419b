/* Generalised forces. */
#ifndef PRBM_FORCES_H
#define PRBM_FORCES_H

#include "core/system.h"

PRBM void springs(int n, const double *K, const double *deflection, double *torque);
PRBM double elastic_energy(int n, const double *K, const double *deflection);
PRBM void field_row(int n, const Complex *S, Complex acceleration, Complex *w);
PRBM void force_row(int n, const Complex *A, Complex force, Complex *w);
/* Set the generalised forces (3, n) of a unit force along x, along y and of a unit moment. */
PRBM void load_rows(const System *system, const BodyFrame *frame, const Complex *e, double *rows,
                    Scratch scratch);
PRBM void generalised(int n, const Complex *w, const Complex *e, double *Q);
/* Add the generalised forces Phi^T Re(w e) of a row w (d,), with repeated columns, to Q (n,). */
PRBM void add_loads(const System *system, const Complex *w, const Complex *e, double *Q);
PRBM double gravitational_energy(const System *system, const Complex *e);
PRBM double normal_force(double lift, double preload, double stiffness);

#endif
