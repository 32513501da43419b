/* Names of contacts and springs in messages. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/friction.h"
#include "hybrid/access.h"
#include "hybrid/configuration.h"
#include "hybrid/contact_names.h"

PRBM const char *contact_name(const Mechanism *m, int contact) {
    int contacts = m->stop_count + m->rubbing_count;
    int k = contact - m->stop_count - m->friction_count;
    for (int i = 0; k >= 0 && i < m->guide_count; i++) {
        if (m->guides[i].rubs && k-- == 0) {
            return m->guides[i].name;
        }
    }
    return contact < m->stop_count ? m->stops[contact].name
           : contact < contacts    ? m->frictions[contact - m->stop_count].name
                                   : m->coils[contact - contacts].name;
}

PRBM bool has_contact(int count, const int *contacts, int contact) {
    for (int k = 0; k < count; k++) {
        if (contacts[k] == contact) {
            return true;
        }
    }
    return false;
}

PRBM void list_contacts(const Mechanism *m, int count, const int *contacts, ContactNames *names) {
    size_t length = 0, size = sizeof names->text;
    names->text[0] = '\0';
    for (int i = 0; i < m->stop_count + m->rubbing_count; i++) {
        if (!has_contact(count, contacts, i)) {
            continue;
        }
        if (length + strlen(contact_name(m, i)) + sizeof ", " + sizeof ", ..." > size) {
            (void)snprintf(names->text + length, size - length, ", ...");
            return;
        }
        (void)snprintf(names->text + length, size - length, "%s%s", length > 0 ? ", " : "",
                       contact_name(m, i));
        length = strlen(names->text);
    }
}

PRBM bool contacts_fail(const Simulation *sim, const ContactFailure *failure, int count,
                        const int *contacts, Problem *problem) {
    ContactNames names;
    list_contacts(sim->configuration.mechanism, count, contacts, &names);
    return fail(problem, "%s at t = %.9g s (%s): %s", failure->cause, sim->state.front_time,
                names.text, failure->remedy);
}

PRBM bool contacts_jam(Simulation *sim, int count, const int *contacts, Problem *problem) {
    static const ContactFailure JAMMED = {
        "no forces satisfy the laws of contact and friction",
        "friction jams the mechanism; reduce the coefficients of friction",
    };
    Scratch scratch = sim->scratch;
    const System *system = system_of(sim);
    const double *v = sim->state.front + system->n;
    Complex *e = directions_at(sim, sim->state.front, &scratch);
    double combinations = 1.0;
    bool guided = false;
    int several = 0;
    for (int k = 0; k < count; k++) {
        int c = contacts[k];
        bool rigid = is_stop(system, c) && !is_pressed(&sim->state.touching[c]);
        bool rough = friction_coefficient(&sim->equations, c) > 0.0;
        bool rests = rough && fabs(sliding_velocity(system, c, e, v)) <= zero_speed(&sim->configuration);
        combinations *= (rigid ? 2.0 : 1.0) * (rests ? 3.0 : 1.0);
        guided = guided || (rests && is_guide(system, c));
        several += rigid || rests;
    }
    contacts_fail(sim, &JAMMED, count, contacts, problem);
    if (guided && combinations > (double)MODES_TRIED_MAX) {
        return fail_further(problem,
                            "%d contacts at rest may have more than the %d combinations of modes that "
                            "are tried", several, MODES_TRIED_MAX);
    }
    return false;
}
