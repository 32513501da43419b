/* A beam whose bending moment is a polynomial. */
#ifndef PRBM_BEAM_H
#define PRBM_BEAM_H

#include "core/profile.h"

/* A section in which a beam is cut: an end, a node, or the waist of a notch. */
typedef struct {
    double position;      /* arc length from the start of the beam [m] */
    double rank;          /* number of the node, -1 or N at the ends, a half between two nodes */
    Complex tangent;      /* direction as drawn, in units of the direction of the chord */
    double pulled, bent;  /* factors of the stress under a normal force and a moment [-] */
    double area, modulus; /* [m^2], [m^3], divided by these factors */
} Cut;

/* Both ends, and at most two waists. */
enum { CUTS_BESIDE_NODES = 4 };

/* A beam of N nodes in all panels, as in the twin. */
typedef struct {
    int order, nodes, panel_count;
    const Panel *panels;
    Line line;
    double youngs_modulus, density; /* [Pa], [kg/m^3] */
    double *S;       /* (N, order + 1) integrals of the polynomials up to the nodes */
    Complex *A;      /* (N, N) integrals of the interpolated directions up to the nodes [m] */
    Complex *whole;  /* (N,) those up to the end [m] */
    double *masses;  /* (N,) [kg] */
    double *radii;   /* (N,) radii of gyration of the sections [m] */
    double *strains; /* (N,) strains with the mean strain [-] */
    double *rates;   /* (order + 1,) rotation between the ends, and coefficients [N m/rad] */
    double axial_rate; /* rate of the mean strain [N m] */
    int cut_count;
    Cut *cuts;         /* (cut_count,) from the start */
    double *moments;   /* (cut_count, order + 1) polynomials of the bending moment at the cuts */
    int smooth, smooth_count; /* first cut, and number, of the nodes with a smooth stress */
} Beam;

/* Compute the nodes and weights (count,) of Gauss' quadrature from -1 to 1. */
PRBM void gauss(int count, double *nodes, double *weights);
/* Compute the integrals S (order + 1,) of the Legendre polynomials from -1 to x, divided by 2. */
PRBM void integrals(int order, double x, double *S);
/* Compute the integrals (nodes,) from -1 to x of the interpolants of values at Gauss points. */
PRBM void interpolation(int nodes, double x, double *result);
/* Compute polynomials P (m, order + 1) that are orthogonal under weights (m,) at points u (m,). */
PRBM void orthogonal(int m, int order, const double *u, const double *weights, double *P,
                     Scratch scratch);
/* The number of doubles that a beam needs. */
PRBM size_t beam_size(int order, int nodes, int panels);
/* Set the arrays of a beam, of which the other members are given. */
PRBM void set_beam(Beam *beam, Scratch *scratch);

#endif
