/* Flexures as rigid segments, torsion springs and axial springs. */
#ifndef PRBM_FLEXURE_H
#define PRBM_FLEXURE_H

#include "core/mechanism.h"

/* A flexure cut into segments: n + 2 lengths and rods, n + 1 rates and lumps, n axial. */
typedef struct {
    int n;
    double *lengths, *rates, *rods, *lumps, *axial;
} Segments;

PRBM bool stub(int pivots, const double *gamma, double *gamma0, Problem *problem);
PRBM void reverse(int count, double *x);
/* The number of links of a flexure, and whether the i-th of n stretches. */
PRBM int links_of(const FlexureType *model, int start_end, int end_end);
PRBM bool stretches(const FlexureType *model, int i, int n);
PRBM bool segments(const FlexureType *model, const double *gamma, const double *K_theta,
                   int start_end, int end_end, double L, double EI, double mass, double EA,
                   Segments *result, Problem *problem);
/* Reverse the segments, so that they go from the end of the flexure to its start. */
PRBM void reversed(Segments *pieces);

#endif
