/* Events: the table of guards and resets, and the first event of a step. */
#ifndef PRBM_EVENTS_H
#define PRBM_EVENTS_H

#include "hybrid/guards.h"

/* Detect and Reset return false on failure, with the reason in *problem. */
typedef bool Watched(const Equations *equations, int contact);
typedef bool Near(Simulation *sim);
typedef bool Detect(Simulation *sim, const Guard *guard, int contact, Fall *fall,
                    Problem *problem);
typedef bool Reset(Simulation *sim, const Event *event, Problem *problem);

/* A row of the table of events. */
typedef struct {
    Guard guard;
    Watched *watched; /* whether the event may occur at a contact */
    Near *near;       /* whether the event may occur in the latest step */
    bool samples;     /* whether detect needs sample_arc */
    Detect *detect;   /* finds the fall of the guard of a contact in the latest step */
    Reset *reset;     /* the change of state at the event */
} Transition;

/* The row of a kind of event.  Events at one time are applied in the order of the kinds. */
PRBM const Transition *transition(EventKind kind);
/* Find the first event within the latest step; its kind is EVENT_NONE if there is no event. */
PRBM bool first_event(Simulation *sim, Event *first, Problem *problem);
/* Count an event and apply its reset.  It fails if events follow each other without end. */
PRBM bool apply_event(Simulation *sim, const Event *event, Problem *problem);

#endif
