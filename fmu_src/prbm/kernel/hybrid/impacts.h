/* Impacts at the stops and impulses at the forces. */
#ifndef PRBM_IMPACTS_H
#define PRBM_IMPACTS_H

#include "hybrid/state.h"

/* Directions, mass matrix and Jacobian of the loops at a position, in working memory. */
typedef struct {
    Complex *e;
    double *M, *loops;
} Inertia;

PRBM Inertia inertia_at(Simulation *sim, const double *q);
PRBM bool mobility(Simulation *sim, const Inertia *at, int r, const double *held,
                   const double *row, double *result, Problem *problem);
PRBM bool independent(Simulation *sim, const Inertia *at, int r, const double *held,
                      const double *row, bool *result, Problem *problem);
PRBM void report_impact(const Simulation *sim, int i, const double *q, const double *v,
                        const double *after);
PRBM bool impact(Simulation *sim, int hit, Problem *problem);
PRBM bool impulses_changed(const Simulation *sim);
PRBM const double *given_impulses(const Simulation *sim);
PRBM bool receive_impulses(Simulation *sim, Problem *problem);

#endif
