/* Generalised forces: the twin of mechanics/forces.py. */
#include "core/forces.h"
#include "core/matrix.h"

PRBM void springs(int n, const double *K, const double *deflection, double *torque) {
    for (int i = 0; i < n; i++) {
        double sum = 0.0;
        for (int j = 0; j < n; j++) {
            sum += K[i * n + j] * deflection[j];
        }
        torque[i] = -sum;
    }
}

PRBM double elastic_energy(int n, const double *K, const double *deflection) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            sum += deflection[i] * K[i * n + j] * deflection[j];
        }
    }
    return 0.5 * sum;
}

PRBM void field_row(int n, const Complex *S, Complex acceleration, Complex *w) {
    force_row(n, S, acceleration, w);
}

PRBM void force_row(int n, const Complex *A, Complex force, Complex *w) {
    Complex turned = complex_of(force.im, force.re); /* i conj(F) */
    for (int j = 0; j < n; j++) {
        w[j] = product(turned, A[j]);
    }
}

PRBM void load_rows(const System *system, const BodyFrame *frame, const Complex *e, double *rows,
                    Scratch scratch) {
    int n = system->n, d = system->d;
    Complex *w = take_complex(&scratch, d, 1);
    zeros(3 * n, rows);
    for (int k = 0; k < 2; k++) {
        force_row(d, frame->A, complex_of(k == 0, k == 1), w);
        repeat_columns(system, 1, w, w);
        add_loads(system, w, e, rows + k * n);
    }
    rows[2 * n + frame->j] = 1.0;
}

PRBM void generalised(int n, const Complex *w, const Complex *e, double *Q) {
    for (int j = 0; j < n; j++) {
        Q[j] = product(w[j], e[j]).re;
    }
}

PRBM void add_loads(const System *system, const Complex *w, const Complex *e, double *Q) {
    for (int j = 0; j < system->d; j++) {
        to_coordinates(system, j, product(w[j], e[j]).re, Q);
    }
}

PRBM double gravitational_energy(const System *system, const Complex *e) {
    Complex fall = {0.0, 0.0};
    for (int j = 0; j < system->d; j++) {
        fall = plus(fall, product(system->S[j], minus(e[j], system->e0[j])));
    }
    return -product(conjugate(system->gravity), fall).re;
}

PRBM double normal_force(double lift, double preload, double stiffness) {
    double force = preload + stiffness * lift;
    return force > 0.0 ? force : 0.0;
}
