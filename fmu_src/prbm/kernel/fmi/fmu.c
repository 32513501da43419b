/* An instance of an FMU: see fmu.h. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi/fmu.h"

static const double TIME_SLACK = 1e-6;  /* of a step: round-off that importers gather */
static const double TIME_ROUND = 1e-12; /* of the time itself */
static const double END_SLACK = 1e-3;   /* of a step: an end that steps were added up to */
#define TO_RESET "reset the instance to start again"

/* --- messages --------------------------------------------------------------------------------- */

enum { MESSAGE_LENGTH = 2048 };

static const struct {
    const char *name;
    unsigned bits;
} CATEGORIES[] = {
    {"logEvents", LOG_EVENTS},        {"logStatusWarning", LOG_WARNING},
    {"logStatusDiscard", LOG_DISCARD}, {"logStatusError", LOG_ERROR},
    {"logStatusFatal", LOG_FATAL},     {"logAll", LOG_EVERYTHING},
};

/* Shorten a text that was cut so that it ends with a whole character. */
static void cut_text(char *text, size_t length) {
    while (length > 0 && ((unsigned char)text[length] & 0xC0) == 0x80) {
        length--;
    }
    text[length] = '\0';
}

/* Double what would begin something, as # the reference of a variable, as far as there is room. */
static void escape(const char *text, const char *special, char *out, size_t room) {
    for (; *text && room > 2; text++, room--) {
        if (strchr(special, *text)) {
            *out++ = *text;
            room--;
        }
        *out++ = *text;
    }
    *out = '\0';
}

static void send(const Journal *journal, int status, const char *format, va_list arguments) {
    unsigned bit = 1u << status;
    if (!journal->callback || !(journal->categories & bit)) {
        return;
    }
    char text[MESSAGE_LENGTH], escaped[2 * MESSAGE_LENGTH];
    int length = vsnprintf(text, sizeof text, format, arguments);
    if (length >= MESSAGE_LENGTH) {
        cut_text(text, MESSAGE_LENGTH - 1);
    }
    escape(text, journal->special, escaped, sizeof escaped);
    journal->send(journal, status, CATEGORIES[status].name, escaped);
}

/* Tell the importer something, in the category of its status; FMU_OK: about an event. */
PRBM void report(const Journal *journal, int status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(journal, status, format, arguments);
    va_end(arguments);
}

/* Tell why something was refused; returns the status. */
PRBM int refuse(const Instance *instance, int status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(&instance->journal, status, format, arguments);
    va_end(arguments);
    return status;
}

static unsigned category_bits(const char *name) {
    for (size_t i = 0; name && i < sizeof CATEGORIES / sizeof *CATEGORIES; i++) {
        if (strcmp(CATEGORIES[i].name, name) == 0) {
            return CATEGORIES[i].bits;
        }
    }
    return LOG_NOTHING;
}

PRBM int choose_categories(Instance *instance, const Rule *rule, bool on, size_t count,
                           const char *const *names) {
    if (!given(instance, rule, count, names)) {
        return FMU_ERROR;
    }
    unsigned chosen = count > 0 ? LOG_NOTHING : LOG_EVERYTHING;
    for (size_t i = 0; i < count; i++) {
        unsigned bits = category_bits(names[i]);
        if (!bits) {
            return refuse(instance, FMU_ERROR,
                          "%s: there is no log category %s; modelDescription.xml lists them all",
                          rule->function, names[i] ? names[i] : "NULL");
        }
        chosen |= bits;
    }
    unsigned before = instance->journal.categories;
    instance->journal.categories = on ? before | chosen : before & ~chosen;
    return FMU_OK;
}

static void hear_impact(void *listener, const Impact *impact) {
    const Instance *instance = listener;
    report(&instance->journal, FMU_OK,
           "impact %d at %s, t = %.9g s: closing at %.6g m/s, opening at %.6g m/s, %.6g J lost",
           impact->count, impact->stop, impact->time, impact->approach_speed,
           impact->rebound_speed, impact->energy_lost);
}

/* --- the state machine ------------------------------------------------------------------------ */

/* What to call next on the way to one of some modes, NULL if none leads there. */
static const char *next_call(const Instance *instance, unsigned modes) {
    const Way *ways = instance->standard->ways[instance->kind];
    const Way *way = &ways[instance->mode];
    for (int i = 0; i < MODES && way->function; i++) {
        if (modes >> way->next & 1u) {
            return ways[instance->mode].function;
        }
        way = &ways[way->next];
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

PRBM bool given(const Instance *instance, const Rule *rule, size_t count, const void *pointer) {
    if (count > 0 && !pointer) {
        refuse(instance, FMU_ERROR, "%s was called with a pointer that is NULL", rule->function);
        return false;
    }
    return true;
}

/* --- what was refused and not yet put right --------------------------------------------------- */

static bool is_parameter(const Mechanism *mechanism, int slot) {
    return slot >= mechanism->slots.parameters && slot < mechanism->slots.inputs;
}

static bool is_input(const Mechanism *mechanism, int slot) {
    return slot >= mechanism->slots.inputs && slot < mechanism->slots.bodies;
}

static bool settable(const Mechanism *mechanism, int slot) {
    return is_parameter(mechanism, slot) || is_input(mechanism, slot);
}

static const char *name_of(const Mechanism *mechanism, int slot) {
    for (int i = 0; i < mechanism->variable_count; i++) {
        if (mechanism->variables[i].slot == slot && mechanism->variables[i].type != CLOCK) {
            return mechanism->variables[i].name;
        }
    }
    return "a variable";
}

/* Tell that a set was refused and how to put it right. */
static void tell_refused(const Instance *instance, int status, int slot) {
    const Mechanism *mechanism = instance->mechanism;
    const char *name = name_of(mechanism, slot), *unit = "";
    Problem problem;
    double present;
    if (!settable(mechanism, slot) ||
        !simulation_get(instance->simulation, slot, &present, &problem)) {
        refuse(instance, status, "%s was set, which is refused: " TO_RESET, name);
        return;
    }
    if (is_parameter(mechanism, slot)) {
        unit = mechanism->parameters[slot].unit;
    }
    refuse(instance, status, "%s was set to what is refused and is still %.10g%s%s: set it to a "
                             "value that it may have, or reset the instance",
           name, present, *unit ? " " : "", unit);
}

/* Whether something was refused and still stands; it is told again. */
static bool stands(const Instance *instance, int status) {
    size_t count = (size_t)instance->mechanism->slots.count;
    const unsigned char *first = memchr(instance->refused, 1, count);
    if (first) {
        tell_refused(instance, status, (int)(first - instance->refused));
    } else if (instance->unknown_refused) {
        refuse(instance, status, "value reference %lu was set, which is not in "
                                 "modelDescription.xml: " TO_RESET,
               (unsigned long)instance->unknown);
    }
    return first || instance->unknown_refused;
}

/* --- life ------------------------------------------------------------------------------------- */

static char *place_text(Memory *memory, const char *text) {
    size_t size = strlen(text) + 1;
    char *copy = place(memory, size, 1);
    if (copy) {
        memcpy(copy, text, size);
    }
    return copy;
}

/* Lay out an instance and its arrays in one block; memory.base NULL: only count. */
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
    it->dvalues = place(memory, slots, sizeof(double));
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
    simulation_listen(simulation, hear_impact, instance);
}

/* Whether the request and the tables fit each other; if not, it is told. */
static bool suits(const Request *request, const Mechanism *mechanism) {
    const Journal *journal = &request->journal;
    if (!request->token || strcmp(request->token, mechanism->token) != 0) {
        report(journal, FMU_ERROR,
               "the %s %s is not the one of the tables in the FMU's folder resources, %s: "
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
    if (!suits(request, mechanism)) {
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
    if (instance->mode == MODE_INTERMEDIATE) { /* its step is still running */
        refuse(instance, FMU_ERROR, "%sFreeInstance cannot be called in %s: return from the "
                                    "callback first",
               instance->standard->prefix, instance->standard->modes[instance->mode]);
        return;
    }
    simulation_close(instance->simulation);
    mechanism_close(instance->mechanism);
    free(instance);
}

static bool sound_times(const Instance *instance, double start_time, bool stop_defined,
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

/* What the importer wants of the whole run; a mistake has to be put right by another call. */
PRBM int set_up(Instance *instance, bool tolerance_defined, double tolerance, double start_time,
                bool stop_defined, double stop_time) {
    const Mechanism *mechanism = instance->mechanism;
    const Parameter *bounds = &mechanism->parameters[mechanism->tolerance];
    Problem problem;
    instance->experiment = instance->experiment_refused = true;
    if (!sound_times(instance, start_time, stop_defined, stop_time)) {
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

static double impact_count(const Instance *instance, int stop) {
    Problem problem;
    double count = 0.0;
    int slot = instance->mechanism->slots.latched + PER_LATCHED * stop + 1;
    (void)simulation_get(instance->simulation, slot, &count, &problem);
    return count;
}

/* The clocks have ticked for all impacts until now. */
static void acknowledge(Instance *instance) {
    for (int i = 0; i < instance->mechanism->stop_count; i++) {
        instance->acknowledged[i] = impact_count(instance, i);
    }
}

/* Start the motion if it has not; false, and told, if something stands against it. */
static bool started(Instance *instance) {
    Problem problem;
    if (simulation_started(instance->simulation)) {
        return true;
    }
    if (stands(instance, FMU_ERROR)) {
        return false;
    }
    if (instance->mode != MODE_INITIALIZATION) {
        refuse(instance, FMU_ERROR, "the instance was never initialized: there is no motion");
        return false;
    }
    if (!simulation_start(instance->simulation, instance->start_time, instance->tolerance,
                          instance->kind == MODEL_EXCHANGE, &problem)) {
        refuse(instance, FMU_ERROR, "%s", problem.text);
        return false;
    }
    acknowledge(instance);
    return true;
}

PRBM int exit_initialization(Instance *instance) {
    if (stands(instance, FMU_ERROR) || !started(instance)) {
        return FMU_ERROR;
    }
    bool event_mode = instance->kind == MODEL_EXCHANGE || instance->event_mode;
    instance->mode = event_mode ? MODE_EVENT : MODE_STEP;
    instance->updated = instance->event_due = false;
    instance->depth_told = 0.0;
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

/* --- values ----------------------------------------------------------------------------------- */

static const char *type_of(const Instance *instance, const Variable *variable) {
    return instance->standard->types[variable->type];
}

static bool required(const Instance *instance, uint32_t reference) {
    for (size_t i = 0; i < instance->required_count; i++) {
        if (instance->required[i] == reference) {
            return true;
        }
    }
    return false;
}

/* The variable of a reference if it may be read as some type; otherwise NULL, and it is told. */
static const Variable *readable(const Instance *instance, uint32_t reference, int type) {
    const Variable *variable = find_variable(instance->mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: it has "
                                    "no value",
               (unsigned long)reference);
    } else if (variable->type != type) {
        const char *actual = type_of(instance, variable);
        refuse(instance, FMU_ERROR, "%s is of type %s: get it with %sGet%s", variable->name,
               actual, instance->standard->prefix, actual);
    } else if (instance->mode == MODE_INTERMEDIATE && !required(instance, reference)) {
        refuse(instance, FMU_ERROR, "%s was not among the requiredIntermediateVariables: get it "
                                    "after the step, or name it at instantiation",
               variable->name);
    } else {
        return variable;
    }
    return NULL;
}

PRBM int read_value(Instance *instance, uint32_t reference, int type, double *x) {
    const Mechanism *mechanism = instance->mechanism;
    const Variable *variable = readable(instance, reference, type);
    Problem problem;
    if (!variable) {
        return FMU_ERROR;
    }
    int slot = variable->slot;
    if (slot == mechanism->slots.time && !simulation_started(instance->simulation)) {
        *x = instance->start_time;
        return FMU_OK;
    }
    if (instance->mode == MODE_INITIALIZATION && !settable(mechanism, slot) &&
        !started(instance)) {
        return FMU_ERROR;
    }
    if (!settable(mechanism, slot) && !simulation_started(instance->simulation)) {
        return refuse(instance, FMU_ERROR, "%s is computed when the instance is initialized, and "
                                           "not known before",
                      variable->name);
    }
    if (!simulation_get(instance->simulation, slot, x, &problem)) {
        bool shorter = instance->mode == MODE_EVENT || instance->mode == MODE_CONTINUOUS;
        bool discard = shorter && instance->kind == MODEL_EXCHANGE;
        return refuse(instance, discard ? FMU_DISCARD : FMU_ERROR, "%s", problem.text);
    }
    return FMU_OK;
}

/* Remember that a set was refused until the variable is set properly. */
static int refuse_set(Instance *instance, int slot) {
    instance->refused[slot] = 1;
    return FMU_ERROR;
}

/* The variable of a reference if it may be set as some type; otherwise NULL, and it is told. */
static const Variable *writable(Instance *instance, uint32_t reference, int type) {
    const Variable *variable = find_variable(instance->mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: it "
                                    "cannot be set; " TO_RESET,
               (unsigned long)reference);
        instance->unknown_refused = true;
        instance->unknown = reference;
        return NULL;
    }
    const char *actual = type_of(instance, variable);
    int slot = variable->slot;
    bool state = instance->kind == MODEL_EXCHANGE && instance->state_of[slot] >= 0;
    if (!settable(instance->mechanism, slot) && !state) {
        refuse(instance, FMU_ERROR, "%s is no parameter or input: it cannot be set; " TO_RESET,
               variable->name);
    } else if (variable->type != type) {
        refuse(instance, FMU_ERROR, "%s is of type %s: set it with %sSet%s", variable->name,
               actual, instance->standard->prefix, actual);
    } else if (state && instance->mode != MODE_CONTINUOUS) {
        refuse(instance, FMU_ERROR, "%s is a state: it can be set in %s only; " TO_RESET,
               variable->name, instance->standard->modes[MODE_CONTINUOUS]);
    } else {
        return variable;
    }
    refuse_set(instance, slot);
    return NULL;
}

static int write_state(Instance *instance, const Variable *variable, double x) {
    if (!finite_number(x)) {
        return refuse(instance, FMU_DISCARD, "%s = %g must be a finite number", variable->name, x);
    }
    exchange_get(instance->simulation, instance->x);
    instance->x[instance->state_of[variable->slot]] = x;
    exchange_set(instance->simulation, instance->x);
    instance->refused[variable->slot] = 0;
    return FMU_OK;
}

/* Whether a variable is not a fixed parameter, which may have any value within its bounds only
 * before the start; if it is, it is told. */
static bool not_fixed(const Instance *instance, int slot, double x, double present) {
    Problem problem;
    if (!is_parameter(instance->mechanism, slot) || !simulation_started(instance->simulation)) {
        return true;
    }
    const Parameter *parameter = &instance->mechanism->parameters[slot];
    if (parameter->tunable || !check_parameter(parameter, x, &problem)) {
        return true;
    }
    const char *unit = parameter->unit, *space = *unit ? " " : "";
    refuse(instance, FMU_ERROR, "%s = %.10g%s%s refused: it is fixed once the simulation has "
                                "started; set it back to %.10g%s%s, or reset the instance and set "
                                "it before",
           parameter->name, x, space, unit, present, space, unit);
    return false;
}

/* What a variable is that may change in event mode alone, now that events have one; or NULL. */
static const char *waits_for_event(const Instance *instance, int slot) {
    const Mechanism *m = instance->mechanism;
    int impulses = m->slots.inputs + m->input.impulses;
    bool exchange = instance->mode == MODE_CONTINUOUS;
    bool impulse = slot >= impulses && slot < impulses + LOADS * m->force_count;
    if (impulse && (exchange || (instance->mode == MODE_STEP && instance->event_mode))) {
        return "an impulse";
    }
    return exchange && is_parameter(m, slot) ? "a parameter" : NULL;
}

PRBM int write_value(Instance *instance, uint32_t reference, int type, double x) {
    const Variable *variable = writable(instance, reference, type);
    Problem problem;
    if (!variable) {
        return FMU_ERROR;
    }
    int slot = variable->slot;
    if (!settable(instance->mechanism, slot)) {
        return write_state(instance, variable, x);
    }
    double present = 0.0;
    bool known = simulation_get(instance->simulation, slot, &present, &problem);
    if (known && present == x) { /* also a fixed parameter that is put back */
        instance->refused[slot] = 0;
        return FMU_OK;
    }
    const char *discrete = waits_for_event(instance, slot);
    if (discrete) {
        refuse(instance, FMU_ERROR, "%s is %s: it can be set in %s, not in %s", variable->name,
               discrete, instance->standard->modes[MODE_EVENT],
               instance->standard->modes[instance->mode]);
        return refuse_set(instance, slot);
    }
    if (instance->mode == MODE_INITIALIZATION) {
        simulation_unstart(instance->simulation);
    }
    if (!not_fixed(instance, slot, x, present)) {
        return refuse_set(instance, slot);
    }
    if (!simulation_set(instance->simulation, slot, x, &problem)) {
        refuse(instance, FMU_ERROR, "%s", problem.text);
        return refuse_set(instance, slot);
    }
    instance->refused[slot] = 0;
    return FMU_OK;
}

static bool ticks(const Instance *instance, const Variable *clock) {
    int stop = (clock->slot - instance->mechanism->slots.latched) / PER_LATCHED;
    return impact_count(instance, stop) != instance->acknowledged[stop];
}

/* Whether a clock ticks in this super-dense instant: its stop has had an impact. */
PRBM int read_clock(Instance *instance, uint32_t reference, bool *active) {
    const Variable *variable = readable(instance, reference, CLOCK);
    if (!variable) {
        return FMU_ERROR;
    }
    *active = ticks(instance, variable);
    return FMU_OK;
}

/* --- co-simulation ---------------------------------------------------------------------------- */

/* Keep the state of the simulation, to go back to. */
static void keep(Instance *instance) {
    const Simulation *simulation = instance->simulation;
    size_t bytes = simulation_state_count(simulation) * sizeof(double);
    memcpy(instance->before, simulation_state(simulation), bytes);
}

static void go_back(Instance *instance) {
    Problem problem;
    (void)simulation_restore(instance->simulation, instance->before, &problem);
}

static int check_step(const Instance *instance, double time, double size) {
    double now = simulation_time(instance->simulation), target = time + size;
    double slack = TIME_SLACK * size + TIME_ROUND * (now < 0.0 ? -now : now);
    double sums = slack + END_SLACK * size;
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

/* Continue to a time, or leave everything as it was. */
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

/* --- model exchange --------------------------------------------------------------------------- */

PRBM int set_time(Instance *instance, double time) {
    if (!finite_number(time)) {
        return refuse(instance, FMU_ERROR, "time = %g s must be a finite number", time);
    }
    exchange_set_time(instance->simulation, time);
    return FMU_OK;
}

/* Whether an array has as many elements as it should; if not, it is told. */
static bool as_many(const Instance *instance, const char *what, int expected, size_t count) {
    if (count == (size_t)expected) {
        return true;
    }
    refuse(instance, FMU_ERROR, "there are %d %s, not %lu", expected, what, (unsigned long)count);
    return false;
}

PRBM int set_states(Instance *instance, const double *x, size_t count) {
    if (!as_many(instance, "continuous states", instance->states, count)) {
        return FMU_ERROR;
    }
    for (size_t i = 0; i < count; i++) {
        if (!finite_number(x[i])) {
            int slot = exchange_slot(instance->simulation, (int)i);
            return refuse(instance, FMU_DISCARD, "%s = %g must be a finite number",
                          name_of(instance->mechanism, slot), x[i]);
        }
    }
    exchange_set(instance->simulation, x);
    return FMU_OK;
}

PRBM int get_states(Instance *instance, double *x, size_t count) {
    if (!as_many(instance, "continuous states", instance->states, count) || !started(instance)) {
        return FMU_ERROR;
    }
    exchange_get(instance->simulation, x);
    return FMU_OK;
}

PRBM int get_nominals(Instance *instance, double *x, size_t count) {
    if (!as_many(instance, "continuous states", instance->states, count)) {
        return FMU_ERROR;
    }
    for (size_t i = 0; i < count; i++) {
        x[i] = 1.0; /* as the standards want it where nothing is known yet */
    }
    if (simulation_started(instance->simulation)) {
        exchange_nominals(instance->simulation, x);
    }
    return FMU_OK;
}

/* Whether the equations can be evaluated; if not, it is told. */
static bool evaluable(Instance *instance) {
    return !stands(instance, FMU_ERROR) && started(instance);
}

PRBM int get_derivatives(Instance *instance, double *dx, size_t count) {
    Problem problem;
    if (!as_many(instance, "continuous states", instance->states, count) || !evaluable(instance)) {
        return FMU_ERROR;
    }
    if (!exchange_derivatives(instance->simulation, dx, &problem)) {
        return refuse(instance, FMU_DISCARD, "%s", problem.text);
    }
    return FMU_OK;
}

PRBM int get_indicators(Instance *instance, double *z, size_t count) {
    Problem problem;
    if (!as_many(instance, "event indicators", instance->indicators, count) ||
        !evaluable(instance)) {
        return FMU_ERROR;
    }
    if (!exchange_event_indicators(instance->simulation, z, &problem)) {
        return refuse(instance, FMU_DISCARD, "%s", problem.text);
    }
    return FMU_OK;
}

PRBM int completed_step(Instance *instance, bool *event) {
    Problem problem;
    if (!evaluable(instance)) {
        return FMU_ERROR;
    }
    if (!exchange_completed_step(instance->simulation, event, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    return FMU_OK;
}

/* --- directional derivatives ------------------------------------------------------------------ */

/* Add the seed of a known; false, and told, if nothing can be differentiated with respect to it. */
static bool seeded(Instance *instance, uint32_t reference, double seed) {
    const Mechanism *mechanism = instance->mechanism;
    const Variable *variable = find_variable(mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: there is "
                                    "no derivative with respect to it",
               (unsigned long)reference);
        return false;
    }
    int slot = variable->slot, state = instance->state_of[slot];
    if (is_input(mechanism, slot)) {
        instance->du[slot - mechanism->slots.inputs] += seed;
    } else if (state >= 0 && instance->mode != MODE_INITIALIZATION) {
        instance->dx[state] += seed;
    } else {
        refuse(instance, FMU_ERROR, "there is no derivative with respect to %s: it is no input%s",
               variable->name,
               state >= 0 ? ", and states are no knowns in Initialization Mode" : " or state");
        return false;
    }
    return true;
}

/* The slot of an unknown, -1 and told if it has no derivatives. */
static int differentiable(const Instance *instance, uint32_t reference) {
    const Mechanism *mechanism = instance->mechanism;
    const Variable *variable = find_variable(mechanism, reference);
    if (!variable) {
        refuse(instance, FMU_ERROR, "value reference %lu is not in modelDescription.xml: it has "
                                    "no derivative",
               (unsigned long)reference);
        return -1;
    }
    if (variable->type != REAL || settable(mechanism, variable->slot) ||
        variable->slot == mechanism->slots.time) {
        refuse(instance, FMU_ERROR, "%s has no derivative: ask for those of outputs and of the "
                                    "derivatives of states",
               variable->name);
        return -1;
    }
    return variable->slot;
}

PRBM int directional_derivative(Instance *instance, const uint32_t *unknowns, size_t unknown_count,
                                const uint32_t *knowns, size_t known_count, const double *seed,
                                double *sensitivity) {
    Problem problem;
    if (!evaluable(instance)) {
        return FMU_ERROR;
    }
    memset(instance->dx, 0, (size_t)instance->states * sizeof(double));
    memset(instance->du, 0, (size_t)instance->mechanism->input_count * sizeof(double));
    for (size_t i = 0; i < known_count; i++) {
        if (!seeded(instance, knowns[i], seed[i])) {
            return FMU_ERROR;
        }
    }
    for (size_t i = 0; i < unknown_count; i++) {
        if (differentiable(instance, unknowns[i]) < 0) {
            return FMU_ERROR;
        }
    }
    if (!exchange_directional(instance->simulation, instance->dx, instance->du, instance->dvalues,
                              &problem)) {
        return refuse(instance, instance->mode == MODE_INITIALIZATION ? FMU_ERROR : FMU_DISCARD,
                      "%s", problem.text);
    }
    for (size_t i = 0; i < unknown_count; i++) {
        sensitivity[i] = instance->dvalues[find_variable(instance->mechanism, unknowns[i])->slot];
    }
    return FMU_OK;
}

/* --- saved states --------------------------------------------------------------------------------
 *
 * All little-endian: "PRBMSTAT"; u32 version, size of the whole, CRC-32 of what follows, standard,
 * kind, whether Event Mode is used, length of the token; the token; u32 mode, flags, last step,
 * unknown reference; f64 start time, stop time, tolerance; one byte a slot, refused; f64 a stop,
 * acknowledged impacts; f64 each, the state of the simulation.  A copy in memory has the same
 * bytes, but no checksum. */

enum { STATE_VERSION = 1, STATE_CHECKED_FROM = 20, STATE_HEAD = 36, STATE_FIXED = 16 + 24 };
static const char STATE_MAGIC[8] = {'P', 'R', 'B', 'M', 'S', 'T', 'A', 'T'};

enum {
    FLAG_EXPERIMENT = 1,
    FLAG_EXPERIMENT_REFUSED = 2,
    FLAG_STOP_DEFINED = 4,
    FLAG_TOLERANCE_DEFINED = 8,
    FLAG_EVENT_DUE = 16,
    FLAG_UPDATED = 32,
    FLAG_UNKNOWN_REFUSED = 64,
    FLAGS = 127
};

static void put_u32(unsigned char **at, uint32_t x) {
    for (int i = 0; i < 4; i++) {
        *(*at)++ = (unsigned char)(x >> 8 * i);
    }
}

static void put_f64(unsigned char **at, double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    put_u32(at, (uint32_t)bits);
    put_u32(at, (uint32_t)(bits >> 32));
}

static uint32_t get_u32(const unsigned char **at) {
    uint32_t x = 0;
    for (int i = 0; i < 4; i++) {
        x |= (uint32_t)*(*at)++ << 8 * i;
    }
    return x;
}

static double get_f64(const unsigned char **at) {
    uint64_t low = get_u32(at), bits = low | (uint64_t)get_u32(at) << 32;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t u32_at(const unsigned char *bytes) {
    return get_u32(&bytes);
}

static size_t saved_size(const Instance *instance) {
    const Mechanism *mechanism = instance->mechanism;
    size_t numbers = (size_t)mechanism->stop_count + simulation_state_count(instance->simulation);
    return STATE_HEAD + strlen(mechanism->token) + STATE_FIXED + (size_t)mechanism->slots.count +
           numbers * sizeof(double);
}

static uint32_t flags_of(const Instance *it) {
    return (it->experiment ? FLAG_EXPERIMENT : 0u) |
           (it->experiment_refused ? FLAG_EXPERIMENT_REFUSED : 0u) |
           (it->stop_defined ? FLAG_STOP_DEFINED : 0u) |
           (it->tolerance_defined ? FLAG_TOLERANCE_DEFINED : 0u) |
           (it->event_due ? FLAG_EVENT_DUE : 0u) | (it->updated ? FLAG_UPDATED : 0u) |
           (it->unknown_refused ? FLAG_UNKNOWN_REFUSED : 0u);
}

static void put_state(const Instance *instance, unsigned char *bytes, size_t size) {
    const Mechanism *mechanism = instance->mechanism;
    size_t length = strlen(mechanism->token), slots = (size_t)mechanism->slots.count;
    unsigned char *at = bytes;
    memcpy(at, STATE_MAGIC, sizeof STATE_MAGIC);
    at += sizeof STATE_MAGIC;
    put_u32(&at, STATE_VERSION);
    put_u32(&at, (uint32_t)size);
    put_u32(&at, 0);
    put_u32(&at, (uint32_t)instance->standard->version);
    put_u32(&at, (uint32_t)instance->kind);
    put_u32(&at, instance->event_mode);
    put_u32(&at, (uint32_t)length);
    memcpy(at, mechanism->token, length);
    at += length;
    put_u32(&at, (uint32_t)instance->mode);
    put_u32(&at, flags_of(instance));
    put_u32(&at, (uint32_t)instance->last_step);
    put_u32(&at, instance->unknown);
    put_f64(&at, instance->start_time);
    put_f64(&at, instance->stop_time);
    put_f64(&at, instance->tolerance);
    memcpy(at, instance->refused, slots);
    at += slots;
    for (int i = 0; i < mechanism->stop_count; i++) {
        put_f64(&at, instance->acknowledged[i]);
    }
    const double *state = simulation_state(instance->simulation);
    for (size_t i = 0; i < simulation_state_count(instance->simulation); i++) {
        put_f64(&at, state[i]);
    }
}

/* Whether bytes are a state of such an instance, as far as their head tells. */
static bool own_state(const Instance *instance, const unsigned char *bytes, size_t size,
                      Problem *problem) {
    const char *token = instance->mechanism->token;
    size_t length = strlen(token);
    if (size < STATE_HEAD || memcmp(bytes, STATE_MAGIC, sizeof STATE_MAGIC) != 0) {
        return fail(problem, "the bytes are no saved state");
    }
    if (u32_at(bytes + 8) != STATE_VERSION) {
        return fail(problem, "the state was saved by another version of this FMU");
    }
    if (u32_at(bytes + 12) != size) {
        return fail(problem, "the saved state is damaged: it has another size than when saved");
    }
    if (u32_at(bytes + 32) != length || size - STATE_HEAD < length ||
        memcmp(bytes + STATE_HEAD, token, length) != 0) {
        return fail(problem, "the state was saved by another model, or another version of this "
                             "one");
    }
    if (u32_at(bytes + 20) != (uint32_t)instance->standard->version ||
        u32_at(bytes + 24) != (uint32_t)instance->kind ||
        u32_at(bytes + 28) != (uint32_t)instance->event_mode) {
        return fail(problem, "the state was saved by an instance that was made for another use: "
                             "FMI version, interface type and eventModeUsed must be the same");
    }
    if (size != saved_size(instance)) {
        return fail(problem, "the state was saved by another version of this FMU");
    }
    return true;
}

/* The modes that an instance of a kind can be in between calls. */
static bool possible_mode(const Instance *instance, uint32_t mode) {
    unsigned modes = IN_INSTANTIATED | IN_INITIALIZATION | IN_TERMINATED;
    if (instance->kind == MODEL_EXCHANGE) {
        modes |= IN_EVENT | IN_CONTINUOUS;
    } else {
        modes |= instance->event_mode ? IN_EVENT | IN_STEP : IN_STEP;
    }
    return mode < MODES && modes >> mode & 1u;
}

/* Read all but the arrays into an instance that is otherwise not looked at. */
static bool got_fields(const Instance *instance, const unsigned char **at, Instance *it,
                       Problem *problem) {
    const Mechanism *mechanism = instance->mechanism;
    uint32_t mode = get_u32(at), flags = get_u32(at), last_step = get_u32(at);
    it->unknown = get_u32(at);
    it->start_time = get_f64(at);
    it->stop_time = get_f64(at);
    it->tolerance = get_f64(at);
    if (!possible_mode(instance, mode) || flags > FLAGS || last_step > FMU_ERROR ||
        !finite_number(it->start_time) || it->stop_time != it->stop_time) {
        return fail(problem, "the saved state is damaged");
    }
    it->mode = (Mode)mode;
    it->last_step = (int)last_step;
    it->experiment = flags & FLAG_EXPERIMENT;
    it->experiment_refused = flags & FLAG_EXPERIMENT_REFUSED;
    it->stop_defined = flags & FLAG_STOP_DEFINED;
    it->tolerance_defined = flags & FLAG_TOLERANCE_DEFINED;
    it->event_due = flags & FLAG_EVENT_DUE;
    it->updated = flags & FLAG_UPDATED;
    it->unknown_refused = flags & FLAG_UNKNOWN_REFUSED;
    const Parameter *bounds = &mechanism->parameters[mechanism->tolerance];
    return it->tolerance_defined ? check_parameter(bounds, it->tolerance, problem)
                                 : it->tolerance == 0.0 || fail(problem, "the saved state is "
                                                                         "damaged");
}

/* Whether the simulation is as far as the mode says. */
static bool agrees(const Simulation *simulation, Mode mode) {
    bool begun = simulation_started(simulation);
    return mode == MODE_INITIALIZATION || mode == MODE_TERMINATED ||
           begun == (mode != MODE_INSTANTIATED);
}

static bool got_simulation(Instance *instance, const unsigned char *at, Mode mode,
                           Problem *problem) {
    Simulation *simulation = instance->simulation;
    size_t count = simulation_state_count(simulation);
    for (size_t i = 0; i < count; i++) {
        instance->after[i] = get_f64(&at);
    }
    keep(instance);
    if (!simulation_restore(simulation, instance->after, problem)) {
        return false;
    }
    if (!agrees(simulation, mode)) {
        go_back(instance);
        return fail(problem, "the saved state is damaged");
    }
    return true;
}

/* Take over a state, or leave everything as it is. */
static bool got_state(Instance *instance, const unsigned char *bytes, size_t size,
                      Problem *problem) {
    const Mechanism *mechanism = instance->mechanism;
    size_t slots = (size_t)mechanism->slots.count;
    if (!own_state(instance, bytes, size, problem)) {
        return false;
    }
    const unsigned char *at = bytes + STATE_HEAD + strlen(mechanism->token);
    Instance read = *instance;
    if (!got_fields(instance, &at, &read, problem)) {
        return false;
    }
    const unsigned char *refused = at, *acknowledged = at + slots;
    at = acknowledged + (size_t)mechanism->stop_count * sizeof(double);
    if (!got_simulation(instance, at, read.mode, problem)) {
        return false;
    }
    *instance = read;
    for (size_t i = 0; i < slots; i++) {
        instance->refused[i] = refused[i] != 0;
    }
    for (int i = 0; i < mechanism->stop_count; i++) {
        instance->acknowledged[i] = get_f64(&acknowledged);
    }
    return true;
}

static Saved *new_saved(size_t size) {
    Saved *saved = malloc(sizeof *saved + size);
    if (saved) {
        saved->size = size;
        saved->bytes = (unsigned char *)(saved + 1);
    }
    return saved;
}

PRBM int save_state(const Instance *instance, void **state) {
    size_t size = saved_size(instance);
    Saved *saved = *state;
    if (saved && saved->size != size) {
        free_state(state);
        saved = NULL;
    }
    saved = saved ? saved : new_saved(size);
    if (!saved) {
        return refuse(instance, FMU_ERROR, "there is not enough memory to save the state");
    }
    put_state(instance, saved->bytes, size);
    *state = saved;
    return FMU_OK;
}

PRBM int restore_state(Instance *instance, const void *state) {
    const Saved *saved = state;
    Problem problem;
    if (!got_state(instance, saved->bytes, saved->size, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    return FMU_OK;
}

PRBM void free_state(void **state) {
    free(*state);
    *state = NULL;
}

PRBM int serialize(const Instance *instance, const void *state, unsigned char *bytes, size_t size) {
    const Saved *saved = state;
    if (size < saved->size) {
        return refuse(instance, FMU_ERROR, "a saved state needs %lu bytes, not %lu",
                      (unsigned long)saved->size, (unsigned long)size);
    }
    memcpy(bytes, saved->bytes, saved->size);
    unsigned char *at = bytes + STATE_CHECKED_FROM - 4;
    put_u32(&at, checksum(bytes + STATE_CHECKED_FROM, saved->size - STATE_CHECKED_FROM));
    return FMU_OK;
}

PRBM int deserialize(const Instance *instance, const unsigned char *bytes, size_t size,
                     void **state) {
    Problem problem;
    /* the buffer may be larger than the state */
    size_t told = size < STATE_HEAD ? 0 : u32_at(bytes + 12);
    size = told >= STATE_HEAD && told < size ? told : size;
    if (!own_state(instance, bytes, size, &problem)) {
        return refuse(instance, FMU_ERROR, "%s", problem.text);
    }
    if (u32_at(bytes + STATE_CHECKED_FROM - 4) !=
        checksum(bytes + STATE_CHECKED_FROM, size - STATE_CHECKED_FROM)) {
        return refuse(instance, FMU_ERROR, "the saved state is damaged: its checksum is wrong");
    }
    Saved *saved = new_saved(size);
    if (!saved) {
        return refuse(instance, FMU_ERROR, "there is not enough memory to restore a state");
    }
    memcpy(saved->bytes, bytes, size);
    *state = saved;
    return FMU_OK;
}
