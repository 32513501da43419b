/* The source of the mechanism's tables: a file in the FMU, or an array that is compiled in. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi/fmu.h"

#if defined(PRBM_TABLES)

#include "mechanism_tables.h"

PRBM Mechanism *tables_read(const char *resources, Problem *problem) {
    (void)resources;
    return mechanism_open(mechanism_tables, sizeof mechanism_tables, problem);
}

#else

#if defined(_WIN32)
#include <wchar.h>
#endif

enum { TABLES_LIMIT = 16 * 1024 * 1024, TABLES_BLOCK = 64 * 1024 };

static const char TABLES_NAME[] = "mechanism.bin";

/* --- the path of the tables ------------------------------------------------------------------- */

static char lower(char c) {
    return (char)(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
}

static bool begins(const char *text, const char *beginning) {
    for (; *beginning; text++, beginning++) {
        if (lower(*text) != *beginning) {
            return false;
        }
    }
    return true;
}

static int hexadecimal(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c = lower(c);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Decode %XX in place; return false for %00, which would end the path.  A % before other characters
 * is kept, because some importers do not encode paths. */
static bool percent_decoded(char *text) {
    char *out = text;
    for (; *text; out++) {
        int high = *text == '%' ? hexadecimal(text[1]) : -1;
        int low = high < 0 ? -1 : hexadecimal(text[2]);
        *out = low < 0 ? *text : (char)(16 * high + low);
        text += low < 0 ? 1 : 3;
        if (!*out) {
            return false;
        }
    }
    *out = '\0';
    return true;
}

static bool drive(const char *path) {
    char c = lower(path[0]);
    return c >= 'a' && c <= 'z' && path[1] == ':';
}

static bool slash(char c) {
#if defined(_WIN32)
    return c == '/' || c == '\\';
#else
    return c == '/';
#endif
}

/* Return the path in file:///x, file:/x, file://localhost/x or file://server/x. */
static char *path_of_uri(char *uri) {
    char *path = uri + strlen("file:");
    if (slash(path[0]) && slash(path[1])) {
        bool here = slash(path[2]) || drive(path + 2); /* Some importers pass file://C:/x. */
        bool local = begins(path + 2, "localhost") && slash(path[11]);
        path += here ? 2 : local ? 11 : 0; /* Otherwise a server: //server/x. */
    }
#if defined(_WIN32)
    if (slash(path[0]) && drive(path + 1)) {
        path++;
    }
#endif
    return path;
}

static bool check_location(const char *resources, Problem *problem) {
    if (!resources || !*resources) {
        return fail(problem, "the importer passed no location of the FMU's folder resources, which "
                             "contains the tables of the mechanism: pass it at instantiation");
    }
    if (!begins(resources, "file:") && strstr(resources, "://")) {
        return fail(problem, "the location of the FMU's folder resources must be a file: URI or a "
                             "path, not %s",
                    resources);
    }
    return true;
}

/* Return the path of the tables in UTF-8, which the caller frees; NULL and a problem on failure.
 * FMI 2.0 passes a URI and FMI 3.0 a path.  Both are accepted in both versions, because no absolute
 * path begins with file:.  Not decoded, a URI is taken as if %XX in it were no code. */
static char *tables_path(const char *resources, bool decode, Problem *problem) {
    size_t length = strlen(resources);
    char *text = malloc(length + sizeof TABLES_NAME + 1);
    if (!text) {
        fail(problem, "there is not enough memory for the path of the FMU's folder resources");
        return NULL;
    }
    memcpy(text, resources, length + 1);
    char *path = text;
    if (begins(text, "file:")) {
        path = path_of_uri(text);
        if (decode && !percent_decoded(path)) {
            fail(problem, "the location of the FMU's folder resources contains %%00");
            free(text);
            return NULL;
        }
    }
    length = strlen(path);
    memmove(text, path, length + 1);
    if (length > 0 && !slash(text[length - 1])) {
        text[length++] = '/';
    }
    memcpy(text + length, TABLES_NAME, sizeof TABLES_NAME);
    return text;
}

/* --- files ------------------------------------------------------------------------------------ */

#if defined(_WIN32)

enum { LONG_PATH = 248 }; /* Longer paths need the prefix \\?\ and must not contain . or .. or /. */

/* Return the code point at *text and advance *text; -1 for invalid UTF-8. */
static int32_t code_point(const unsigned char **text) {
    static const int32_t least[4] = {0, 0x80, 0x800, 0x10000};
    const unsigned char *at = *text;
    int more = at[0] < 0x80 ? 0 : at[0] >= 0xF0 ? 3 : at[0] >= 0xE0 ? 2 : 1;
    int32_t code = more ? at[0] & (0x3F >> more) : at[0];
    if ((at[0] >= 0x80 && at[0] < 0xC0) || at[0] >= 0xF8) {
        return -1;
    }
    for (int i = 1; i <= more; i++) {
        if ((at[i] & 0xC0) != 0x80) {
            return -1;
        }
        code = code << 6 | (at[i] & 0x3F);
    }
    *text += more + 1;
    return code < least[more] || code > 0x10FFFF || (code >> 11) == 0x1B ? -1 : code;
}

/* Convert a text to UTF-16, with \ for /; return false for invalid UTF-8. */
static bool widened(const char *text, wchar_t *wide) {
    const unsigned char *at = (const unsigned char *)text;
    while (*at) {
        int32_t code = code_point(&at);
        if (code < 0) {
            return false;
        }
        if (code >= 0x10000) {
            *wide++ = (wchar_t)(0xD800 + ((code - 0x10000) >> 10));
            code = 0xDC00 + ((code - 0x10000) & 0x3FF);
        }
        *wide++ = (wchar_t)(code == '/' ? '\\' : code);
    }
    *wide = L'\0';
    return true;
}

/* Copy an absolute path without empty names and ., and resolve every .. in it. */
static void normalized(const wchar_t *path, wchar_t *out) {
    wchar_t *root = out;
    while (*path) {
        size_t length = wcscspn(path, L"\\");
        bool up = length == 2 && path[0] == L'.' && path[1] == L'.';
        bool stay = length == 0 || (length == 1 && path[0] == L'.');
        if (up) {
            while (out > root && *--out != L'\\') {
            }
        } else if (!stay) {
            *out++ = L'\\';
            wmemcpy(out, path, length);
            out += length;
        }
        path += length + (path[length] == L'\\');
    }
    *out = L'\0';
}

/* Open a file by its path in UTF-16, with the prefix of long paths if needed. */
static FILE *opened(const char *path) {
    size_t room = strlen(path) + 16;
    wchar_t *wide = calloc(2 * room, sizeof *wide);
    FILE *file = NULL;
    if (wide && widened(path, wide)) {
        wchar_t *name = wide;
        bool server = wide[0] == L'\\' && wide[1] == L'\\' && wide[2] != L'?' && wide[2] != L'.';
        bool on_drive = drive(path) && wide[2] == L'\\';
        if (wcslen(wide) >= LONG_PATH && (server || on_drive)) {
            name = wide + room;
            wcscpy(name, server ? L"\\\\?\\UNC" : L"\\\\?");
            normalized(wide, name + wcslen(name));
        }
        file = _wfopen(name, L"rb");
    } else if (wide) {
        file = fopen(path, "rb"); /* The importer passed a path in the code page of the system. */
    }
    free(wide);
    return file;
}

#else

static FILE *opened(const char *path) {
    return fopen(path, "rb");
}

#endif

/* Return all bytes of a file, which the caller frees; NULL and a problem on failure. */
static unsigned char *contents(FILE *file, size_t *size, Problem *problem) {
    unsigned char *bytes = NULL;
    size_t room = 0;
    *size = 0;
    do {
        room = room ? 2 * room : TABLES_BLOCK;
        unsigned char *more = realloc(bytes, room);
        if (!more) {
            fail(problem, "there is not enough memory for the tables of the mechanism");
            free(bytes);
            return NULL;
        }
        bytes = more;
        *size += fread(bytes + *size, 1, room - *size, file);
    } while (*size == room && room <= TABLES_LIMIT);
    if (ferror(file) || *size > TABLES_LIMIT) {
        fail(problem, ferror(file) ? "the tables of the mechanism (%s) cannot be read completely"
                                   : "the tables of the mechanism (%s) are larger than 16 MiB: "
                                     "this is not the file that belongs to the FMU",
             TABLES_NAME);
        free(bytes);
        return NULL;
    }
    return bytes;
}

/* Open the tables; NULL and a problem on failure.  The path as it stands is the second attempt,
 * because some importers do not encode a % in the name of a folder. */
static FILE *opened_tables(const char *resources, Problem *problem) {
    if (!check_location(resources, problem)) {
        return NULL;
    }
    char *path = tables_path(resources, true, problem);
    FILE *file = path ? opened(path) : NULL;
    if (!file) {
        Problem ignored;
        char *plain = tables_path(resources, false, &ignored);
        file = plain ? opened(plain) : NULL;
        free(plain);
    }
    if (!file && path) {
        fail(problem, "the tables of the mechanism cannot be opened; unpack the whole FMU, "
                      "including its folder resources: there is no readable file %s", path);
    }
    free(path);
    return file;
}

PRBM Mechanism *tables_read(const char *resources, Problem *problem) {
    FILE *file = opened_tables(resources, problem);
    if (!file) {
        return NULL;
    }
    size_t size;
    unsigned char *bytes = contents(file, &size, problem);
    (void)fclose(file);
    Mechanism *mechanism = bytes ? mechanism_open(bytes, size, problem) : NULL;
    free(bytes);
    return mechanism;
}

#endif
