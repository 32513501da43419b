/* Flexures as free bodies. */
#ifndef PRBM_FREE_BODY_H
#define PRBM_FREE_BODY_H

#include "core/beam.h"
#include "core/flexure.h"
#include "core/system.h"

/* Begin with a flexure whose first mass point is the next one.  NULL: no flexure has stress. */
PRBM FreeBody *begin_free_body(System *system, const Step *step);
/* Store the rank of the mass points that have been added since the last call: twice the number of
 * their segment, or of their pivot plus 1. */
PRBM void rank_points(FreeBody *body, const System *system, int rank);
/* Complete a flexure of links.  direction: as drawn, from the near end to the far end; owners: the
 * directions of the segments. */
PRBM void keep_links(System *system, const Step *step, const Segments *pieces, Complex direction,
                     const int *owners);
/* Complete a beam.  direction: as drawn, from the start to the end; ends: coordinates of the
 * rotations of start and end; first: the first coefficient. */
PRBM void keep_beam(System *system, const Step *step, const Beam *beam, Complex direction,
                    const int *ends, int first);
PRBM void place_free_bodies(System *system, Memory *memory);

#endif
