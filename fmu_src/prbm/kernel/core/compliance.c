/* The law of compliant stops: the twin of mechanics/compliance.py. */
#include <math.h>

#include "core/compliance.h"

PRBM double damping_factor(double restitution) {
    double e = restitution;
    if (e > DAMPING_ELASTIC_MIN) {
        return 3.0 * (1.0 - e * e) / (2.0 * (1.0 + e * e * e));
    }
    if (e < DAMPING_PLASTIC_MAX) {
        return 1.0 / e;
    }
    double low = 0.5 * (1.0 - e), high = 1.0 / e;
    for (int k = 0; k < DAMPING_BISECTIONS; k++) {
        double a = 0.5 * (low + high);
        bool below = natural_log((1.0 + a) / (1.0 - a * e)) < a * (1.0 + e);
        low = below ? a : low;
        high = below ? high : a;
    }
    return 0.5 * (low + high);
}

PRBM double elastic_force(const ComplianceLaw *law, double d) {
    if (law->exponent == 1.0 || d == 0.0) {
        return law->stiffness * d;
    }
    return law->stiffness * copysign(power(fabs(d), law->exponent), d);
}

PRBM double damping_ratio(const ComplianceLaw *law, const ContactPhase *touching, double rate) {
    return touching->phase == PHASE_RISING
               ? 1.0 + law->damping
               : 1.0 + law->damping * rate / touching->reference_speed;
}

PRBM double contact_force(const ComplianceLaw *law, const ContactPhase *touching, double d,
                          double rate) {
    return touching->phase == PHASE_FREE
               ? 0.0
               : elastic_force(law, d) * damping_ratio(law, touching, rate);
}

PRBM double contact_energy(const ComplianceLaw *law, double d) {
    return elastic_force(law, fabs(d)) * fabs(d) / (law->exponent + 1.0);
}

PRBM double contact_depth(const ComplianceLaw *law, double force) {
    return power(force / law->stiffness, 1.0 / law->exponent);
}

PRBM double contact_tangent(const ComplianceLaw *law, double d) {
    return law->exponent * elastic_force(law, d) / d;
}

PRBM double contact_stiffness(const ComplianceLaw *law, double d) {
    if (law->exponent == 1.0) {
        return law->stiffness;
    }
    return d == 0.0 ? 0.0 : contact_tangent(law, d);
}

PRBM double damping_slope(const ComplianceLaw *law, const ContactPhase *touching) {
    return touching->phase == PHASE_RISING ? 0.0 : law->damping / touching->reference_speed;
}
