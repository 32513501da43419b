/* Communication steps and events. */
#include <string.h>

#include "fmi/fmu.h"

/* Save the state of the simulation for go_back. */
PRBM void keep(Instance *instance) {
    simulation_save(instance->simulation, instance->before);
}

PRBM void go_back(Instance *instance) {
    Problem problem;
    (void)simulation_restore(instance->simulation, instance->before, &problem);
}

/* --- co-simulation ---------------------------------------------------------------------------- */

static int check_step(const Instance *instance, double time, double size) {
    double now = simulation_time(instance->simulation), target = time + size;
    double slack = STEP_SUM_RTOL * size + TIME_SUM_RTOL * (now < 0.0 ? -now : now);
    double sums = slack + STOP_TIME_RTOL * size;
    if (has_rejected(instance, FMU_DISCARD)) {
        return FMU_DISCARD;
    }
    if (instance->event_due) {
        return refuse(instance, FMU_ERROR, "an event is pending at t = %.12g s: call "
                                           "%sEnterEventMode first",
                      now, instance->standard->prefix);
    }
    if (!finite_number(time) || !finite_number(size)) {
        return refuse(instance, FMU_DISCARD,
                      "currentCommunicationPoint = %g s and communicationStepSize = %g s must be "
                      "finite numbers",
                      time, size);
    }
    if (size <= 0.0) {
        return refuse(instance, FMU_DISCARD, "communicationStepSize = %.9g s must be positive",
                      size);
    }
    if (time - now > slack || now - time > slack) {
        return refuse(instance, FMU_DISCARD,
                      "the step begins at t = %.12g s, but the last step ended at t = %.12g s: "
                      "continue there, or restore a saved state",
                      time, now);
    }
    if (!(target > now)) {
        return refuse(instance, FMU_DISCARD, "communicationStepSize = %.9g s is below the rounding "
                                             "error of t = %.12g s: make a longer step",
                      size, now);
    }
    if (instance->stop_defined && target - instance->stop_time > sums) {
        return refuse(instance, FMU_ERROR,
                      "the step would end at t = %.12g s, but stopTime = %.12g s: make a shorter "
                      "step, or set the experiment up without stopTime",
                      target, instance->stop_time);
    }
    return FMU_OK;
}

/* Advance from event to event, and from internal step to internal step if there are intermediate
 * updates.  Stop at the first event if the importer handles events and allows early return. */
static bool advance_by_events(Instance *instance, double target, Outcome *outcome,
                              Problem *problem) {
    Simulation *simulation = instance->simulation;
    bool stops = instance->event_mode && instance->early_return, each = instance->update != NULL;
    bool enough = false;
    Effort effort = {0, 0, 0.0};
    do {
        bool event = false;
        if (!simulation_advance_some(simulation, target, each, &effort, &event, problem)) {
            return false;
        }
        outcome->event |= event && instance->event_mode;
        if (event && stops) {
            instance->event_due = true;
            return true;
        }
        if (event && !simulation_handle_event(simulation, problem)) {
            return false;
        }
        enough = each && instance->update(instance);
    } while (!enough && simulation_time(simulation) < target);
    return true;
}

/* Advance to a time; on failure, leave the state unchanged. */
static bool advanced(Instance *instance, double target, Outcome *outcome, Problem *problem) {
    Simulation *simulation = instance->simulation;
    if (!instance->event_mode && !instance->update) {
        return simulation_advance(simulation, target, problem);
    }
    keep(instance);
    if (advance_by_events(instance, target, outcome, problem)) {
        return true;
    }
    go_back(instance);
    return false;
}

/* Make a communication step.  With event mode but without early return, an event inside the step
 * has been handled when the step ends.  It is still reported to the importer, because discrete
 * variables have new values and clocks may tick. */
PRBM int make_step(Instance *instance, double time, double size, Outcome *outcome) {
    Problem problem;
    Outcome result = {false, false, 0.0};
    int status = check_step(instance, time, size);
    if (status == FMU_OK && !advanced(instance, time + size, &result, &problem)) {
        status = refuse(instance, FMU_DISCARD, "%s", problem.text);
        result.event = false;
    }
    result.time = simulation_time(instance->simulation);
    result.early = status == FMU_OK && result.time < time + size;
    instance->last_step = status;
    *outcome = result;
    return status;
}

/* --- events ----------------------------------------------------------------------------------- */

PRBM int enter_event_mode(Instance *instance) {
    instance->mode = MODE_EVENT;
    instance->updated = false;
    return FMU_OK;
}

static bool any_tick(const Instance *instance) {
    const Mechanism *mechanism = instance->mechanism;
    for (int i = 0; i < mechanism->variable_count; i++) {
        if (mechanism->variables[i].type == CLOCK && ticks(instance, &mechanism->variables[i])) {
            return true;
        }
    }
    return false;
}

/* Log a warning if a wall penetrates a body, and again when the penetration has doubled.  A warning
 * is never a return status: some importers stop at any status but OK. */
static void warn_of_depth(Instance *instance) {
    double depth;
    const char *stop = exchange_deepest(instance->simulation, &depth);
    if (!stop || depth <= 2.0 * instance->depth_logged) {
        return;
    }
    instance->depth_logged = depth;
    report(&instance->journal, FMU_WARNING,
           "%s.gap = %.6g m: the wall is inside the body, which is not pushed out; move it "
           "continuously, with %s.displacement and %s.velocity, or integrate in shorter steps",
           stop, -depth, stop, stop);
}

/* Handle the pending events.  A clock ticks in a separate super-dense instant after an impact, in
 * which variables have their values after the impact; the next call ends this instant. */
PRBM int update_discrete_states(Instance *instance, bool *again, bool *changed) {
    Problem problem;
    if (has_rejected(instance, FMU_ERROR)) {
        return FMU_ERROR;
    }
    acknowledge(instance);
    *changed = false;
    bool exchange = instance->kind == MODEL_EXCHANGE;
    if (exchange ? !exchange_event(instance->simulation, changed, &problem)
                 : !simulation_handle_event(instance->simulation, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    *again = instance->clocks && any_tick(instance);
    instance->event_due = false;
    instance->updated = !*again;
    if (exchange) {
        warn_of_depth(instance);
    }
    return FMU_OK;
}

/* Whether an update of the discrete states would change anything. */
static bool update_pending(Instance *instance) {
    bool pending = true;
    Problem problem;
    if (instance->clocks && any_tick(instance)) {
        return true;
    }
    if (instance->kind == CO_SIMULATION) {
        return instance->event_due;
    }
    return !exchange_pending(instance->simulation, &pending, &problem) || pending;
}

/* Leave Event Mode.  Some importers do not update the discrete states before, which is accepted if
 * nothing is pending. */
PRBM int leave_event_mode(Instance *instance, const Rule *rule, Mode next) {
    if (!instance->updated && has_rejected(instance, FMU_ERROR)) {
        return FMU_ERROR;
    }
    if (!instance->updated && update_pending(instance)) {
        return refuse(instance, FMU_ERROR, "%s: the event is not finished; call %s = false",
                      rule->function,
                      instance->standard->version == 2
                          ? "fmi2NewDiscreteStates until newDiscreteStatesNeeded"
                          : "fmi3UpdateDiscreteStates until discreteStatesNeedUpdate");
    }
    instance->mode = next;
    return FMU_OK;
}
