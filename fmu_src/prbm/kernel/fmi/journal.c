/* Messages to the importer. */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "fmi/fmu.h"

enum { MESSAGE_LENGTH = 2048 };

static const struct {
    const char *name;
    unsigned bits;
} CATEGORIES[] = {
    {"logEvents", LOG_EVENTS},        {"logStatusWarning", LOG_WARNING},
    {"logStatusDiscard", LOG_DISCARD}, {"logStatusError", LOG_ERROR},
    {"logStatusFatal", LOG_FATAL},     {"logAll", LOG_EVERYTHING},
};

/* Cut a UTF-8 text to a length, or shorter so that it ends with a whole character. */
static void cut_text(char *text, size_t length) {
    while (length > 0 && ((unsigned char)text[length] & 0xC0) == 0x80) {
        length--;
    }
    text[length] = '\0';
}

/* Copy a text with its special characters doubled, as far as there is room.  In FMI a # begins the
 * reference of a variable, and a % a conversion of printf. */
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

/* Log a message in the category of its status; FMU_OK is the category of events. */
PRBM void report(const Journal *journal, int status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(journal, status, format, arguments);
    va_end(arguments);
}

/* Log the reason of a rejection and return its status. */
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
                          "%s: unknown log category %s; modelDescription.xml lists all categories",
                          rule->function, names[i] ? names[i] : "NULL");
        }
        chosen |= bits;
    }
    unsigned before = instance->journal.categories;
    instance->journal.categories = on ? before | chosen : before & ~chosen;
    return FMU_OK;
}

PRBM void log_impact(void *listener, const Impact *impact) {
    const Instance *instance = listener;
    report(&instance->journal, FMU_OK,
           "impact %d at %s, t = %.9g s: closing at %.6g m/s, opening at %.6g m/s, %.6g J lost",
           impact->count, impact->stop, impact->time, impact->approach_speed,
           impact->rebound_speed, impact->energy_lost);
}

PRBM bool given(const Instance *instance, const Rule *rule, size_t count, const void *pointer) {
    if (count > 0 && !pointer) {
        refuse(instance, FMU_ERROR, "%s was called with a pointer that is NULL", rule->function);
        return false;
    }
    return true;
}
