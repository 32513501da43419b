/* Parameters drawn over their declared bounds: one to three of them, or all. */
#include "driver.h"

void drawn_parameters(Subject *s, size_t steps) {
    if (!subject_instantiate(s)) {
        return;
    }
    const Plan *plan = s->plan;
    if (s->seed % 2) {
        for (unsigned i = 1 + below(&s->random, 3); i > 0; i--) {
            const Variable *v = plan->variables + pick(s, "ptk");
            (void)subject_set(s, v, drawn_over_bounds(&s->random, v));
        }
    } else {
        for (size_t i = 0; i < plan->count; i++) {
            const Variable *v = plan->variables + i;
            if (v->role == FIXED || v->role == TUNABLE || v->role == GEOMETRY) {
                (void)subject_set(s, v, drawn_over_bounds(&s->random, v));
            }
        }
    }
    Outcome outcome = RAN;
    if (!FINE(subject_enter(s)) || !FINE(subject_exit(s))) {
        outcome = REJECTED_AT_START;
    } else {
        subject_observe(s);
        for (size_t i = 0; i < steps && outcome == RAN; i++) {
            if (FINE(subject_step(s, plan->step))) {
                subject_observe(s);
            } else {
                outcome = REJECTED_LATER;
            }
        }
    }
    s->counts->outcomes[outcome]++;
    subject_free(s);
}
