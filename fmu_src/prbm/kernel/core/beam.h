/* A beam whose bending moment is a polynomial. */
#ifndef PRBM_BEAM_H
#define PRBM_BEAM_H

#include "core/memory.h"

/* A uniform beam of N nodes, as in the twin. */
typedef struct {
    int order, nodes;
    double *S;      /* (N, order + 1) integrals of the Legendre polynomials up to the nodes */
    double *A;      /* (N, N) integrals of the interpolated directions up to the nodes [m] */
    double *whole;  /* (N,) those up to the end [m] */
    double *masses; /* (N,) [kg] */
    double *places; /* (N,) arc lengths of the nodes [m] */
    double *moments; /* (N, order + 1) the polynomials of the bending moment at the nodes */
    double *rates;  /* (order + 1,) rotation between the ends, and coefficients [N m/rad] */
} Beam;

/* Compute the nodes and weights (count,) of Gauss' quadrature from -1 to 1. */
PRBM void gauss(int count, double *nodes, double *weights);
/* Compute the integrals S (order + 1,) of the Legendre polynomials from -1 to x, divided by 2. */
PRBM void integrals(int order, double x, double *S);
PRBM Beam take_beam(int order, int nodes, Scratch *scratch);
/* Compute a beam of the length L [m], bending stiffness EI [N m^2] and mass [kg]. */
PRBM void set_beam(Beam *beam, double L, double EI, double mass, Scratch *scratch);

#endif
