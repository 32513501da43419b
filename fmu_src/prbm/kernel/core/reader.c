/* The reader of untrusted bytes: numbers, texts, counts and references. */
#include <string.h>

#include "core/reader.h"

PRBM void *kept(Reader *reader, size_t count, size_t size) {
    size_t left = reader->room - reader->memory.used; /* place adds less than 32 bytes. */
    if (reader->wrong || left < 32 || count > (left - 32) / size) {
        reader->wrong = reader->wrong ? reader->wrong : "counts that are too large for its size";
        return NULL;
    }
    return place(&reader->memory, count, size);
}

static bool has(Reader *reader, size_t bytes) {
    if (!reader->wrong && reader->left < bytes) {
        reader->wrong = "an unexpected end";
    }
    return !reader->wrong;
}

PRBM uint32_t read_u32(Reader *reader) {
    uint32_t x = 0;
    if (has(reader, 4)) {
        for (int i = 3; i >= 0; i--) {
            x = x << 8 | reader->at[i];
        }
        reader->at += 4;
        reader->left -= 4;
    }
    return x;
}

static double read_f64(Reader *reader) {
    uint64_t low = read_u32(reader), bits = low | (uint64_t)read_u32(reader) << 32;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

PRBM double read_bound(Reader *reader) {
    double x = read_f64(reader);
    if (x != x) {
        reader->wrong = "a bound that is NaN";
    }
    return x;
}

PRBM double read_finite(Reader *reader) {
    double x = read_f64(reader);
    if (!finite_number(x)) {
        reader->wrong = "a number that is not finite";
    }
    return x;
}

PRBM const char *read_text(Reader *reader) {
    size_t length = read_u32(reader);
    if (length >= reader->left || !has(reader, length + 1) || reader->at[length] != 0 ||
        memchr(reader->at, 0, length)) {
        reader->wrong = reader->wrong ? reader->wrong : "a text without its terminating zero";
        return "";
    }
    char *text = kept(reader, length + 1, 1);
    if (text) {
        memcpy(text, reader->at, length + 1);
        reader->at += length + 1;
        reader->left -= length + 1;
    }
    return text ? text : "";
}

/* Read an index i with from <= i < count. */
PRBM int read_index(Reader *reader, int from, int count) {
    uint32_t x = read_u32(reader);
    if (x < (uint32_t)from || x >= (uint32_t)count) {
        reader->wrong = reader->wrong ? reader->wrong : "an index out of range";
        return from;
    }
    return (int)x;
}

PRBM bool read_flag(Reader *reader) {
    return read_index(reader, 0, 2) == 1;
}

/* Read the number of the records that follow; each has at least the given number of bytes. */
PRBM int read_count(Reader *reader, size_t bytes) {
    uint32_t count = read_u32(reader);
    if (count > reader->left / bytes) {
        reader->wrong = reader->wrong ? reader->wrong : "counts that are too large for its size";
        return 0;
    }
    return (int)count;
}
