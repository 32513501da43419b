/* Load shared libraries; on Windows their paths are converted from UTF-8 to UTF-16. */
#include "importer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>

static void *load(const char *path) {
    int length = MultiByteToWideChar(CP_UTF8, 0, path, -1, NULL, 0);
    wchar_t *wide = malloc((size_t)length * sizeof *wide);
    if (!wide) {
        return NULL;
    }
    MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, length);
    void *handle = LoadLibraryExW(wide, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
    if (!handle) {
        fprintf(stderr, "importer: %s: error %lu of LoadLibrary\n", path, GetLastError());
    }
    free(wide);
    return handle;
}

static void find(void *handle, const char *name, void *function, size_t size) {
    FARPROC found = GetProcAddress((HMODULE)handle, name);
    memcpy(function, &found, size);
}

static void unload(void *handle) {
    FreeLibrary((HMODULE)handle);
}

#else
#include <dlfcn.h>

static void *load(const char *path) {
    void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
        fprintf(stderr, "importer: %s\n", dlerror());
    }
    return handle;
}

/* Standard C has no conversion from void * to a function pointer; memcpy copies its bytes. */
static void find(void *handle, const char *name, void *function, size_t size) {
    void *found = dlsym(handle, name);
    memcpy(function, &found, size);
}

static void unload(void *handle) {
    dlclose(handle);
}

#endif

bool library_open(Library *library, const char *path, int version) {
    bool complete = true;
    memset(library, 0, sizeof *library);
    library->version = version;
    library->handle = load(path);
    if (!library->handle) {
        return false;
    }
#define FIND(number, name)                                                                         \
    if (version == number) {                                                                       \
        find(library->handle, "fmi" #number #name, &library->f##number.name,                       \
             sizeof library->f##number.name);                                                      \
        if (!library->f##number.name) {                                                            \
            fprintf(stderr, "importer: %s has no function fmi" #number #name "\n", path);          \
            complete = false;                                                                      \
        }                                                                                          \
    }
#define FIND2(name) FIND(2, name)
#define FIND3(name) FIND(3, name)
    FMI2_FUNCTIONS(FIND2)
    FMI3_FUNCTIONS(FIND3)
    if (!complete) {
        library_close(library);
    }
    return complete;
}

void library_close(Library *library) {
    unload(library->handle);
}
