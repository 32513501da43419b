/* Instances: the state machine of the standards, rejected values, creation and release. */
#include <stdlib.h>
#include <string.h>

#include "fmi/fmu.h"

/* --- the state machine ------------------------------------------------------------------------ */

/* Return the next function to call in order to reach one of some modes, NULL if no function leads
 * there. */
static const char *next_call(const Instance *instance, unsigned modes) {
    const ModeTransition *transitions = instance->standard->transitions[instance->kind];
    const ModeTransition *transition = &transitions[instance->mode];
    for (int i = 0; i < MODES && transition->function; i++) {
        if (modes >> transition->next & 1u) {
            return transitions[instance->mode].function;
        }
        transition = &transitions[transition->next];
    }
    return NULL;
}

PRBM Instance *allowed(void *handle, const Rule *rule) {
    Instance *instance = handle;
    if (!instance) {
        return NULL;
    }
    unsigned modes = rule->modes[instance->kind];
    if (modes >> instance->mode & 1u) {
        return instance;
    }
    const char *mode = instance->standard->modes[instance->mode];
    const char *next = next_call(instance, modes);
    if (modes == IN_NONE) {
        bool exchange = instance->kind == MODEL_EXCHANGE;
        refuse(instance, FMU_ERROR, "%s is for %s; this instance was made for %s", rule->function,
               exchange ? "co-simulation" : "model exchange",
               exchange ? "model exchange" : "co-simulation");
    } else if (instance->mode == MODE_INTERMEDIATE) {
        refuse(instance, FMU_ERROR, "%s cannot be called in %s: return from the callback first",
               rule->function, mode);
    } else if (next) {
        refuse(instance, FMU_ERROR, "%s cannot be called in %s: call %s first", rule->function,
               mode, next);
    } else {
        refuse(instance, FMU_ERROR, "%s cannot be called in %s: call %sReset first",
               rule->function, mode, instance->standard->prefix);
    }
    return NULL;
}

/* --- rejected values -------------------------------------------------------------------------- */

PRBM bool is_parameter(const Mechanism *mechanism, int slot) {
    return slot >= mechanism->slots.parameters && slot < mechanism->slots.inputs;
}

PRBM bool is_input(const Mechanism *mechanism, int slot) {
    return slot >= mechanism->slots.inputs && slot < mechanism->slots.bodies;
}

PRBM bool settable(const Mechanism *mechanism, int slot) {
    return is_parameter(mechanism, slot) || is_input(mechanism, slot);
}

PRBM const char *name_of(const Mechanism *mechanism, int slot) {
    for (int i = 0; i < mechanism->variable_count; i++) {
        if (mechanism->variables[i].slot == slot && mechanism->variables[i].type != CLOCK) {
            return mechanism->variables[i].name;
        }
    }
    return "a variable";
}

/* Log that the last set of a variable was rejected, with its present value and a remedy. */
static void log_rejected(const Instance *instance, int status, int slot) {
    const Mechanism *mechanism = instance->mechanism;
    const char *name = name_of(mechanism, slot), *unit = "";
    Problem problem;
    double present;
    if (!settable(mechanism, slot) ||
        !simulation_get(instance->simulation, slot, &present, &problem)) {
        refuse(instance, status, "%s was set, but it cannot be set: " TO_RESET, name);
        return;
    }
    if (is_parameter(mechanism, slot)) {
        unit = mechanism->parameters[slot].unit;
    }
    refuse(instance, status, "%s was set to a rejected value and is still %.10g%s%s: set it to a "
                             "valid value, or reset the instance",
           name, present, *unit ? " " : "", unit);
}

/* Return whether a rejected value has not been corrected yet; if so, log the first again. */
PRBM bool has_rejected(const Instance *instance, int status) {
    size_t count = (size_t)instance->mechanism->slots.count;
    const unsigned char *first = memchr(instance->refused, 1, count);
    if (first) {
        log_rejected(instance, status, (int)(first - instance->refused));
    } else if (instance->unknown_refused) {
        refuse(instance, status, "value reference %lu was set, but it is not in "
                                 "modelDescription.xml: " TO_RESET,
               (unsigned long)instance->unknown);
    }
    return first || instance->unknown_refused;
}

/* --- creation and release --------------------------------------------------------------------- */

static char *place_text(Memory *memory, const char *text) {
    size_t size = strlen(text) + 1;
    char *copy = place(memory, size, 1);
    if (copy) {
        memcpy(copy, text, size);
    }
    return copy;
}

/* Place an instance and its arrays in one block; without a block, only count the bytes. */
static Instance *place_instance(Memory *memory, const Request *request, const Mechanism *mechanism,
                                const Simulation *simulation) {
    Instance scrap, *instance = place(memory, 1, sizeof *instance);
    Instance *it = instance ? instance : &scrap;
    size_t slots = (size_t)mechanism->slots.count, states = (size_t)exchange_states(simulation);
    it->journal.instance = place_text(memory, request->journal.instance);
    it->required = place(memory, request->required_count, sizeof *it->required);
    it->refused = place(memory, slots, 1);
    it->acknowledged = place(memory, (size_t)mechanism->stop_count, sizeof(double));
    it->state_of = place(memory, slots, sizeof(int));
    it->before = place(memory, simulation_state_count(simulation), sizeof(double));
    it->after = place(memory, simulation_state_count(simulation), sizeof(double));
    it->x = place(memory, states, sizeof(double));
    it->dx = place(memory, states, sizeof(double));
    it->du = place(memory, (size_t)mechanism->input_count, sizeof(double));
    it->dp = place(memory, (size_t)mechanism->parameter_count, sizeof(double));
    it->dvalues = place(memory, slots, sizeof(double));
    it->shifted = place(memory, slots, sizeof(double));
    return instance;
}

static Instance *new_instance(const Request *request, const Mechanism *mechanism,
                              const Simulation *simulation) {
    Memory memory = {NULL, 0};
    place_instance(&memory, request, mechanism, simulation);
    memory.base = calloc(1, memory.used);
    memory.used = 0;
    return memory.base ? place_instance(&memory, request, mechanism, simulation) : NULL;
}

static void find_states(Instance *instance) {
    for (int slot = 0; slot < instance->mechanism->slots.count; slot++) {
        instance->state_of[slot] = -1;
    }
    for (int k = 0; k < instance->states; k++) {
        instance->state_of[exchange_slot(instance->simulation, k)] = k;
    }
}

static void fill_instance(Instance *instance, const Request *request, Mechanism *mechanism,
                          Simulation *simulation) {
    const char *name = instance->journal.instance;
    instance->standard = request->standard;
    instance->kind = request->kind;
    instance->journal = request->journal;
    instance->journal.instance = name;
    instance->event_mode = request->event_mode;
    instance->early_return = request->early_return;
    instance->update = request->update;
    instance->intermediate = request->intermediate;
    instance->required_count = request->required_count;
    if (request->required_count > 0) {
        memcpy(instance->required, request->required,
               request->required_count * sizeof *request->required);
    }
    instance->mechanism = mechanism;
    instance->simulation = simulation;
    instance->states = exchange_states(simulation);
    instance->indicators = exchange_indicators(simulation);
    for (int i = 0; i < mechanism->variable_count; i++) {
        instance->clocks |= mechanism->variables[i].type == CLOCK;
    }
    find_states(instance);
    simulation_listen(simulation, log_impact, instance);
}

/* Check the arguments of an instantiation against the tables; log an error and return false if
 * they are inconsistent. */
static bool check_request(const Request *request, const Mechanism *mechanism) {
    const Journal *journal = &request->journal;
    if (!request->token || strcmp(request->token, mechanism->token) != 0) {
        report(journal, FMU_ERROR,
               "the %s %s differs from that of the tables in the FMU's folder resources, %s: "
               "modelDescription.xml and the tables belong to different FMUs",
               request->standard->version == 2 ? "GUID" : "instantiation token",
               request->token ? request->token : "NULL", mechanism->token);
        return false;
    }
    for (size_t i = 0; i < request->required_count; i++) {
        if (!request->required || !find_variable(mechanism, request->required[i])) {
            report(journal, FMU_ERROR,
                   "requiredIntermediateVariables has an entry that is not in "
                   "modelDescription.xml: pass value references of its variables");
            return false;
        }
    }
    bool clocks = false;
    for (int i = 0; i < mechanism->variable_count; i++) {
        clocks |= mechanism->variables[i].type == CLOCK;
    }
    if (clocks && request->kind == CO_SIMULATION && !request->event_mode) {
        report(journal, FMU_ERROR, "this FMU has clocks, so its importer must handle events: "
                                   "instantiate it with eventModeUsed = true, or use the FMU "
                                   "without clocks");
        return false;
    }
    return true;
}

PRBM Instance *instance_open(const Request *request) {
    Problem problem;
    Mechanism *mechanism = tables_read(request->resources, &problem);
    if (!mechanism) {
        report(&request->journal, FMU_ERROR, "%s", problem.text);
        return NULL;
    }
    if (!check_request(request, mechanism)) {
        mechanism_close(mechanism);
        return NULL;
    }
    Simulation *simulation = simulation_open(mechanism);
    Instance *instance = simulation ? new_instance(request, mechanism, simulation) : NULL;
    if (!instance) {
        report(&request->journal, FMU_ERROR, "there is not enough memory for an instance");
        if (simulation) {
            simulation_close(simulation);
        }
        mechanism_close(mechanism);
        return NULL;
    }
    fill_instance(instance, request, mechanism, simulation);
    return instance;
}

PRBM void instance_close(Instance *instance) {
    if (!instance) {
        return;
    }
    if (instance->mode == MODE_INTERMEDIATE) { /* The step that called back is still running. */
        refuse(instance, FMU_ERROR, "%sFreeInstance cannot be called in %s: return from the "
                                    "callback first",
               instance->standard->prefix, instance->standard->modes[instance->mode]);
        return;
    }
    simulation_close(instance->simulation);
    mechanism_close(instance->mechanism);
    free(instance);
}

static bool check_times(const Instance *instance, double start_time, bool stop_defined,
                        double stop_time) {
    if (!finite_number(start_time)) {
        refuse(instance, FMU_ERROR, "startTime = %g s must be a finite number", start_time);
        return false;
    }
    if (stop_defined && !(stop_time >= start_time)) {
        refuse(instance, FMU_ERROR, "stopTime = %.9g s must not be before startTime = %.9g s",
               stop_time, start_time);
        return false;
    }
    return true;
}

/* Set the times and the tolerance of the simulation.  After an error it must be called again. */
PRBM int set_up(Instance *instance, bool tolerance_defined, double tolerance, double start_time,
                bool stop_defined, double stop_time) {
    const Mechanism *mechanism = instance->mechanism;
    const Parameter *bounds = &mechanism->parameters[mechanism->tolerance];
    Problem problem;
    instance->experiment = instance->experiment_refused = true;
    if (!check_times(instance, start_time, stop_defined, stop_time)) {
        return FMU_ERROR;
    }
    if (tolerance_defined && !check_parameter(bounds, tolerance, &problem)) {
        return refuse(instance, FMU_ERROR, "the importer's relative tolerance: %s", problem.text);
    }
    instance->experiment_refused = false;
    instance->tolerance_defined = tolerance_defined;
    instance->tolerance = tolerance_defined ? tolerance : 0.0;
    instance->start_time = start_time;
    instance->stop_defined = stop_defined;
    instance->stop_time = stop_defined ? stop_time : 0.0;
    return FMU_OK;
}

PRBM double impact_count(const Instance *instance, int stop) {
    Problem problem;
    double count = 0.0;
    int slot = instance->mechanism->slots.latched + PER_LATCHED * stop + LATCHED_IMPACT_COUNT;
    (void)simulation_get(instance->simulation, slot, &count, &problem);
    return count;
}

/* Mark all impacts so far as those for which the clocks have ticked. */
PRBM void acknowledge(Instance *instance) {
    for (int i = 0; i < instance->mechanism->stop_count; i++) {
        instance->acknowledged[i] = impact_count(instance, i);
    }
}

/* Log a warning if the equilibrium under gravity, or the held shape at release, is unstable. */
static bool warn_of_instability(Instance *instance, Problem *problem) {
    int rest = 0, release = 0;
    if (!simulation_instability(instance->simulation, &rest, &release, problem)) {
        return false;
    }
    if (rest > 0) {
        report(&instance->journal, FMU_WARNING,
               "the equilibrium under gravity, without stops, is unstable in %d of its directions: "
               "mode.frequency is 0",
               rest);
    }
    if (release > 0) {
        report(&instance->journal, FMU_WARNING,
               "the shape at release is unstable in %d of its directions while it is held: a small "
               "disturbance determines how the motion begins; release closer to a stable shape",
               release);
    }
    return true;
}

/* Log a warning if the tolerance of co-simulation is too loose to be used. */
PRBM bool start_instance(Instance *instance, Problem *problem) {
    Simulation *simulation = instance->simulation;
    bool exchange = instance->kind == MODEL_EXCHANGE;
    if (!simulation_start(simulation, instance->start_time, instance->tolerance, exchange,
                          problem)) {
        return false;
    }
    if (!warn_of_instability(instance, problem) ||
        !(exchange || simulation_check_effort(simulation, problem))) {
        simulation_unstart(simulation);
        return false;
    }
    if (exchange) {
        return true;
    }
    double wanted = simulation_requested(simulation, instance->tolerance);
    if (wanted > TOLERANCE_USED_MAX) {
        report(&instance->journal, FMU_WARNING,
               "tolerance = %g is replaced by %g: looser tolerances lose energy without notice",
               wanted, TOLERANCE_USED_MAX);
    }
    return true;
}

/* Start the simulation if needed.  Log the reason and return false on failure. */
PRBM bool started(Instance *instance) {
    Problem problem;
    if (simulation_started(instance->simulation)) {
        return true;
    }
    if (has_rejected(instance, FMU_ERROR)) {
        return false;
    }
    if (instance->mode != MODE_INITIALIZATION) {
        refuse(instance, FMU_ERROR, "the instance was never initialized: " TO_RESET);
        return false;
    }
    if (!start_instance(instance, &problem)) {
        refuse(instance, FMU_ERROR, "%s", problem.text);
        return false;
    }
    acknowledge(instance);
    return true;
}

PRBM int exit_initialization(Instance *instance) {
    if (has_rejected(instance, FMU_ERROR) || !started(instance)) {
        return FMU_ERROR;
    }
    bool event_mode = instance->kind == MODEL_EXCHANGE || instance->event_mode;
    instance->mode = event_mode ? MODE_EVENT : MODE_STEP;
    instance->updated = instance->event_due = false;
    instance->depth_logged = 0.0;
    return FMU_OK;
}

PRBM int end_run(Instance *instance) {
    instance->mode = MODE_TERMINATED;
    return FMU_OK;
}

PRBM int reset(Instance *instance) {
    simulation_reset(instance->simulation);
    instance->mode = MODE_INSTANTIATED;
    instance->experiment = instance->experiment_refused = false;
    instance->stop_defined = instance->tolerance_defined = false;
    instance->start_time = instance->stop_time = instance->tolerance = 0.0;
    instance->event_due = instance->updated = false;
    instance->last_step = FMU_OK;
    instance->unknown_refused = false;
    instance->unknown = 0;
    memset(instance->refused, 0, (size_t)instance->mechanism->slots.count);
    for (int i = 0; i < instance->mechanism->stop_count; i++) {
        instance->acknowledged[i] = 0.0;
    }
    return FMU_OK;
}
