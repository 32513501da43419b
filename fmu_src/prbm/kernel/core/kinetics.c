/* Mass matrix and quadratic-velocity matrix: the twin of mechanics/kinetics.py. */
#include "core/kinetics.h"

PRBM void inertia(int n, const Complex *H, const double *J, const Complex *e, double *M,
                  double *C) {
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            Complex turned = product(product(conjugate(e[i]), H[i * n + j]), e[j]);
            M[i * n + j] = turned.re + (i == j ? J[i] : 0.0);
            C[i * n + j] = -turned.im;
        }
    }
}
