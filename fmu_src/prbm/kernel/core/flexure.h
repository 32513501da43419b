/* Flexures as rigid segments, torsion springs and axial springs. */
#ifndef PRBM_FLEXURE_H
#define PRBM_FLEXURE_H

#include "core/mechanism.h"

/* Segments of a flexure with n links, from its start to its end: a stub, the links, a stub. */
typedef struct {
    int n;
    double *lengths; /* (n + 2,) [m] */
    double *rates;   /* (n + 1,) torsion springs between consecutive segments [N m/rad] */
    double *rods;    /* (n + 2,) masses of the segments as slender rods [kg] */
    double *lumps;   /* (n + 1,) masses at the pivots [kg] */
    double *axial;   /* (n,) axial stiffness of the links [N/m]; 0 for rigid links */
} Segments;

/* Compute the length of the stub at the clamp, *gamma0 = 1 - sum(gamma), in units of h.  Return
 * false if it is negative. */
PRBM bool stub(int pivots, const double *gamma, double *gamma0, Problem *problem);
/* Reverse the order of the numbers x (count,). */
PRBM void reverse(int count, double *x);
/* Return the number of links of a flexure.  The types of its ends are CLAMP, PIN or FREE. */
PRBM int links_of(const FlexureType *model, int type_at_start, int type_at_end);
/* Return whether link i of the n links, counted from 0, stretches. */
PRBM bool stretches(const FlexureType *model, int type_at_start, int i, int n);
/* Compute the segments of a flexure with the length L [m], the bending stiffness EI [N m^2], the
 * mass [kg] and the axial stiffness EA [N].  Return false if the links are longer than the flexure.
 * result points to memory for the arrays. */
PRBM bool segments(const FlexureType *model, const double *gamma, const double *K_theta,
                   int type_at_start, int type_at_end, double L, double EI, double mass, double EA,
                   Segments *result, Problem *problem);
/* Reverse the segments, so that they go from the end of the flexure to its start. */
PRBM void reversed(Segments *pieces);

#endif
