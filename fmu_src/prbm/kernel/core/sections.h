/* Forces, moments and stress in the sections of flexures. */
#ifndef PRBM_SECTIONS_H
#define PRBM_SECTIONS_H

#include "core/beam.h"
#include "core/dynamics.h"
#include "core/flexure.h"

/* A polynomial and its first two derivatives at a point. */
typedef struct {
    double value, slope, bend;
} Jet;

/* Stress of the left face at start and end, the largest magnitude with the number of its section or
 * of one beside it (from 1 at the start, negative for the right face), and its position. */
typedef struct {
    double start, end, largest, place, position;
} Stress;

/* A state and the loads on it, or the changes of both. */
typedef struct {
    const Complex *e;       /* (d,) */
    const double *q;        /* (n,) */
    const double *strained; /* (n,) q - rest + beta v */
    Complex *loads;         /* (p,) of the mass points */
    Complex *on;            /* (b + 1,) sums of the forces on the bodies, the ground's first */
    Complex *far;           /* (flexures,) forces on the far ends */
} SectionState;

/* Add the forces of closed stops and of friction points on the bodies to on (b + 1,). */
PRBM void add_contact_pulls(const Equations *eq, const Complex *e, const Evaluation *found,
                            Complex *on);
/* Compute the forces on the far ends of all flexures, and add the forces of flexures and joints on
 * the bodies.  lam: the multipliers, or their changes. */
PRBM void transmit(const System *system, const double *lam, SectionState *at);
/* Compute the state at which sections are loaded, in working memory. */
PRBM SectionState section_state(const Equations *eq, const Complex *e, const double *angle,
                                const double *v, const Evaluation *found, Scratch *scratch);
/* Compute the stress of the left and of the right face in the sections of a flexure, (m,), (m,). */
PRBM void face_stresses(const System *system, const FreeBody *body, const SectionState *at,
                        double *left, double *right);
/* Compute the changes of these stresses along a change of the state. */
PRBM void face_changes(const System *system, const FreeBody *body, const SectionState *at,
                       const SectionState *change, double *left, double *right);
/* Replace values c (m,) at points x (m,) by their divided differences. */
PRBM void differences(int m, const double *x, double *c);
/* Compute a polynomial at s from its divided differences. */
PRBM Jet polynomial(int m, const double *x, const double *c, double s);
/* Find a maximum (sign 1) or minimum (-1) of a polynomial between low and high; false: none. */
PRBM bool summit(int m, const double *x, const double *c, double sign, double low, double high,
                 double *s);
PRBM Stress stress_in(const FreeBody *body, const double *left, const double *right);
/* Return the stress, or its change, at the face and the position of the largest one, from those of
 * the faces in the sections. */
PRBM double stress_at(const FreeBody *body, const double *left, const double *right,
                      const Stress *found);
/* Take working memory for the stress of several flexures. */
PRBM Stress *take_stresses(Scratch *scratch, int count);
/* Compute the stress of all flexures whose stress is an output. */
PRBM void stresses(const Equations *eq, const Complex *e, const double *angle, const double *v,
                   const Evaluation *evaluation, Stress *found, Scratch scratch);

#endif
