/* The law of compliant stops. */
#ifndef PRBM_COMPLIANCE_H
#define PRBM_COMPLIANCE_H

#include "core/contact_state.h"

/* The force k d^n (1 + a d'/v0): stiffness k [N/m^n], exponent n and factor a of the damping. */
typedef struct {
    double stiffness, exponent, damping;
} ComplianceLaw;

PRBM double damping_factor(double restitution);
PRBM double elastic_force(const ComplianceLaw *law, double d); /* sign(d) k |d|^n */
PRBM double damping_ratio(const ComplianceLaw *law, const ContactPhase *touching, double rate);
PRBM double contact_force(const ComplianceLaw *law, const ContactPhase *touching, double d,
                          double rate);
PRBM double contact_energy(const ComplianceLaw *law, double d);
PRBM double contact_depth(const ComplianceLaw *law, double force); /* of an elastic force >= 0 */
PRBM double contact_tangent(const ComplianceLaw *law, double d); /* d > 0 */
PRBM double contact_stiffness(const ComplianceLaw *law, double d); /* any d */
/* Change of the damping ratio per change of the rate of the indentation. */
PRBM double damping_slope(const ComplianceLaw *law, const ContactPhase *touching);

#endif
