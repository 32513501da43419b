/* Reader of job files.  Each line has a keyword and its arguments. */
#include "importer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

double bits_to_number(uint64_t bits) {
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

uint64_t number_to_bits(double number) {
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

static double number(const char *digits) {
    return bits_to_number(strtoull(digits, NULL, 16));
}

static char *whole_file(const char *path) {
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    size_t size = 0, room = 0;
    if (!file) {
        return NULL;
    }
    do {
        room = 2 * room + 4096;
        char *larger = realloc(text, room + 1);
        if (!larger) {
            break;
        }
        text = larger;
        size += fread(text + size, 1, room - size, file);
    } while (size == room);
    fclose(file);
    if (text) {
        text[size] = '\0';
    }
    return text;
}

/* Return an array with room for one more element.  Its size is doubled when it is full. */
static void *grown(void *array, size_t count, size_t size) {
    bool full = (count & (count - 1)) == 0;
    void *larger = full ? realloc(array, (count ? 2 * count : 1) * size) : array;
    if (!larger) {
        fprintf(stderr, "importer: no memory\n");
        exit(2);
    }
    return larger;
}

/* Add an item from its text "reference type [bits]". */
static void add_item(Item **items, size_t *count, const char *arguments, size_t point) {
    char *rest;
    *items = grown(*items, *count, sizeof **items);
    Item *item = *items + (*count)++;
    item->reference = (uint32_t)strtoul(arguments, &rest, 10);
    item->type = rest[0] ? rest[1] : '?';
    item->value = rest[0] && rest[1] && rest[2] ? number(rest + 3) : 0.0;
    item->point = point;
}

static Kind kind(const char *word) {
    if (strcmp(word, "events") == 0) {
        return WITH_EVENTS;
    }
    return strcmp(word, "me") == 0 ? MODEL_EXCHANGE : CO_SIMULATION;
}

static bool read_line(Job *job, const char *keyword, const char *rest) {
    if (strcmp(keyword, "fmi") == 0) {
        job->version = atoi(rest);
    } else if (strcmp(keyword, "kind") == 0) {
        job->kind = kind(rest);
    } else if (strcmp(keyword, "library") == 0) {
        job->library = rest;
    } else if (strcmp(keyword, "resources") == 0) {
        job->resources = rest;
    } else if (strcmp(keyword, "name") == 0) {
        job->name = rest;
    } else if (strcmp(keyword, "token") == 0) {
        job->token = rest;
    } else if (strcmp(keyword, "tolerance") == 0) {
        job->has_tolerance = true;
        job->tolerance = number(rest);
    } else if (strcmp(keyword, "start") == 0) {
        job->start = number(rest);
    } else if (strcmp(keyword, "stop") == 0) {
        job->has_stop = true;
        job->stop = number(rest);
    } else if (strcmp(keyword, "substep") == 0) {
        job->substep = number(rest);
    } else if (strcmp(keyword, "states") == 0) {
        job->state_count = strtoul(rest, NULL, 10);
    } else if (strcmp(keyword, "indicators") == 0) {
        job->indicator_count = strtoul(rest, NULL, 10);
    } else if (strcmp(keyword, "set") == 0) {
        add_item(&job->sets, &job->set_count, rest, 0);
    } else if (strcmp(keyword, "record") == 0) {
        add_item(&job->records, &job->record_count, rest, 0);
    } else if (strcmp(keyword, "change") == 0) {
        add_item(&job->changes, &job->change_count, rest, job->point_count);
    } else if (strcmp(keyword, "point") == 0) {
        job->points = grown(job->points, job->point_count, sizeof *job->points);
        job->points[job->point_count++] = number(rest);
    } else {
        fprintf(stderr, "importer: unknown keyword \"%s\" in the job\n", keyword);
        return false;
    }
    return true;
}

bool job_read(Job *job, const char *path) {
    memset(job, 0, sizeof *job);
    job->text = whole_file(path);
    if (!job->text) {
        fprintf(stderr, "importer: the job %s cannot be read\n", path);
        return false;
    }
    char *line = job->text;
    while (*line) {
        size_t length = strcspn(line, "\n"), word = strcspn(line, " \n");
        char *next = line + length + (line[length] == '\n');
        line[length] = '\0';
        if (length) {
            char *rest = line + word + (word < length);
            line[word] = '\0';
            if (!read_line(job, line, rest)) {
                return false;
            }
        }
        line = next;
    }
    return job->library && job->resources && job->name && job->token && job->point_count;
}

void job_free(Job *job) {
    free(job->sets);
    free(job->records);
    free(job->changes);
    free(job->points);
    free(job->text);
}
