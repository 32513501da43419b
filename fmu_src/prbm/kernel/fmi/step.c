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
    if (stands(instance, FMU_DISCARD)) {
        return FMU_DISCARD;
    }
    if (instance->event_due) {
        return refuse(instance, FMU_ERROR, "an event waits at t = %.12g s: call %sEnterEventMode "
                                           "first",
                      now, instance->standard->prefix);
    }
    if (!finite_number(time) || !finite_number(size)) {
        return refuse(instance, FMU_DISCARD,
                      "cannot step from t = %g s by %g s: not finite numbers", time, size);
    }
    if (size <= 0.0) {
        return refuse(instance, FMU_DISCARD, "communicationStepSize = %.9g s must be positive; "
                                             "time only runs on",
                      size);
    }
    if (time - now > slack || now - time > slack) {
        return refuse(instance, FMU_DISCARD,
                      "the step begins at t = %.12g s, but the last one ended at t = %.12g s: "
                      "continue there, or restore a saved state",
                      time, now);
    }
    if (!(target > now)) {
        return refuse(instance, FMU_DISCARD, "communicationStepSize = %.9g s is lost in round-off "
                                             "at t = %.12g s: make a longer step",
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

/* Continue event by event, and internal step by internal step where the importer wants to see
 * them.  Stops at the first event if the importer handles events and lets a step end early. */
static bool walk(Instance *instance, double target, Outcome *outcome, Problem *problem) {
    Simulation *simulation = instance->simulation;
    bool stops = instance->event_mode && instance->early_return, each = instance->update != NULL;
    bool enough = false;
    do {
        bool event = false;
        if (!simulation_advance_some(simulation, target, each, &event, problem)) {
            return false;
        }
        outcome->event |= event && instance->event_mode;
        if (event && stops) {
            instance->event_due = true;
            return true;
        }
        if (event && !simulation_happen(simulation, problem)) {
            return false;
        }
        enough = each && instance->update(instance);
    } while (!enough && simulation_time(simulation) < target);
    return true;
}

/* Continue to a time; on failure the state stays as it was. */
static bool advanced(Instance *instance, double target, Outcome *outcome, Problem *problem) {
    Simulation *simulation = instance->simulation;
    if (!instance->event_mode && !instance->update) {
        return simulation_advance(simulation, target, problem);
    }
    keep(instance);
    if (walk(instance, target, outcome, problem)) {
        return true;
    }
    go_back(instance);
    return false;
}

/* In Event Mode without early return, an event inside the step is over when the step ends; the
 * importer is still told of it, since discrete variables have new values and clocks may tick. */
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

/* Tell of a wall that was put deep into a body, or a body that was taken through it; again when it is
 * twice as deep. */
static int warn_of_depth(Instance *instance) {
    double depth;
    const char *stop = exchange_deepest(instance->simulation, &depth);
    if (!stop || depth <= 2.0 * instance->depth_told) {
        return FMU_OK;
    }
    instance->depth_told = depth;
    return refuse(instance, FMU_WARNING,
                  "%s.gap = %.6g m: the wall is inside the body, which is not pushed out; move it "
                  "continuously, with %s.displacement and %s.velocity, or integrate in shorter steps",
                  stop, -depth, stop, stop);
}

/* Let happen what is due.  A clock that ticks because of it does so in a super-dense instant of
 * its own, in which its variables have the values after the impact; the next call ends it. */
PRBM int update_discrete_states(Instance *instance, bool *again, bool *changed) {
    Problem problem;
    if (stands(instance, FMU_ERROR)) {
        return FMU_ERROR;
    }
    acknowledge(instance);
    *changed = false;
    bool exchange = instance->kind == MODEL_EXCHANGE;
    if (exchange ? !exchange_event(instance->simulation, changed, &problem)
                 : !simulation_happen(instance->simulation, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    *again = instance->clocks && any_tick(instance);
    instance->event_due = false;
    instance->updated = !*again;
    return exchange ? warn_of_depth(instance) : FMU_OK;
}

PRBM int leave_event_mode(Instance *instance, const Rule *rule, Mode next) {
    if (!instance->updated) {
        return refuse(instance, FMU_ERROR, "%s: the event is not finished; call %s until it asks "
                                           "for no further call",
                      rule->function,
                      instance->standard->version == 2 ? "fmi2NewDiscreteStates"
                                                       : "fmi3UpdateDiscreteStates");
    }
    instance->mode = next;
    return FMU_OK;
}
