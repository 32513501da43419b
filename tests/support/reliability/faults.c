/* A library for LD_PRELOAD: it counts the calls that change files below a folder, and kills the
 * process before one of them, or lets it and all later ones fail as on a full disk.
 *
 * fault_arm(folder, kind, at) begins the count; fault_count() returns it, and fault_failed() the
 * number of calls that failed.
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { NO_FAULT, KILL, FULL_DISK, FILES = 1024 };

static char folder[4096];
static int kind, at, count, failed;
static bool watched[FILES]; /* by descriptor: a file below the folder is open for writing */

void fault_arm(const char *path, int new_kind, int new_at);
int fault_count(void);
int fault_failed(void);

void fault_arm(const char *path, int new_kind, int new_at) {
    snprintf(folder, sizeof folder, "%s", path);
    kind = new_kind;
    at = new_at;
    count = failed = 0;
}

int fault_count(void) {
    return count;
}

int fault_failed(void) {
    return failed;
}

static bool below_folder(const char *path) {
    return folder[0] && path && strncmp(path, folder, strlen(folder)) == 0;
}

/* Count a change; return whether it must fail. */
static bool change(bool needs_space) {
    count++;
    if (kind == KILL && count == at) {
        kill(getpid(), SIGKILL);
    }
    if (kind == FULL_DISK && count >= at && needs_space) {
        errno = ENOSPC;
        failed++;
        return true;
    }
    return false;
}

static void *real(const char *name) {
    return dlsym(RTLD_NEXT, name);
}

static int opened(const char *name, const char *path, int flags, mode_t mode) {
    union {
        void *pointer;
        int (*function)(const char *, int, mode_t);
    } next = {real(name)};
    bool writes = (flags & (O_WRONLY | O_RDWR | O_CREAT)) && below_folder(path);
    if (writes && change(flags & O_CREAT)) {
        return -1;
    }
    int file = next.function(path, flags, mode);
    if (file >= 0 && file < FILES) {
        watched[file] = writes;
    }
    return file;
}

#define OPEN(name)                                   \
    int name(const char *path, int flags, ...) {     \
        va_list arguments;                           \
        va_start(arguments, flags);                  \
        mode_t mode = va_arg(arguments, mode_t);     \
        va_end(arguments);                           \
        return opened(#name, path, flags, mode);     \
    }
OPEN(open)
OPEN(open64)

ssize_t write(int file, const void *bytes, size_t size) {
    union {
        void *pointer;
        ssize_t (*function)(int, const void *, size_t);
    } next = {real("write")};
    if (file >= 0 && file < FILES && watched[file]) {
        if (change(true)) {
            return -1;
        }
        if (kind == KILL && count + 1 == at && size > 1) { /* a part of the content arrives */
            (void)!next.function(file, bytes, size / 2);
            kill(getpid(), SIGKILL);
        }
    }
    return next.function(file, bytes, size);
}

#define ONE_PATH(name, needs_space, parameters, path, call)              \
    int name parameters {                                                \
        union {                                                          \
            void *pointer;                                               \
            int (*function) parameters;                                  \
        } next = {real(#name)};                                          \
        return below_folder(path) && change(needs_space) ? -1 : next.function call; \
    }
ONE_PATH(rename, false, (const char *from, const char *to), to, (from, to))
ONE_PATH(mkdir, true, (const char *path, mode_t mode), path, (path, mode))
ONE_PATH(unlink, false, (const char *path), path, (path))
ONE_PATH(rmdir, false, (const char *path), path, (path))
ONE_PATH(chmod, false, (const char *path, mode_t mode), path, (path, mode))

int fsync(int file) {
    union {
        void *pointer;
        int (*function)(int);
    } next = {real("fsync")};
    bool ours = file >= 0 && file < FILES && watched[file];
    return ours && change(true) ? -1 : next.function(file);
}
