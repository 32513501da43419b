/* Numbers and checksums in the bytes of saved states and tables. */
#ifndef BYTES_H
#define BYTES_H

#include <stddef.h>
#include <stdint.h>

/* Write x in little-endian order. */
static inline void put_u32(uint8_t *at, uint32_t x) {
    for (int i = 0; i < 4; i++) {
        at[i] = (uint8_t)(x >> 8 * i);
    }
}

/* The CRC-32 of zlib. */
static inline uint32_t crc(const uint8_t *bytes, size_t size) {
    uint32_t c = 0xFFFFFFFFu;
    for (size_t i = 0; i < size; i++) {
        c ^= bytes[i];
        for (int k = 0; k < 8; k++) {
            c = c >> 1 ^ (c & 1 ? 0xEDB88320u : 0);
        }
    }
    return ~c;
}

#endif
