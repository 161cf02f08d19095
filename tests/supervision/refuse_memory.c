/* Makes one memory allocation of a process fail: LD_PRELOAD this library with LEO_REFUSED_ALLOCATION=N. The number of
 * allocations is written to the file LEO_ALLOCATIONS when the process ends. Its children are not affected. */
#define _GNU_SOURCE
#include <errno.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);

static atomic_long count;
static long refused;
static char *report;

__attribute__((constructor)) static void begin(void) {
    const char *number = getenv("LEO_REFUSED_ALLOCATION");
    report = getenv("LEO_ALLOCATIONS");
    unsetenv("LD_PRELOAD");
    atomic_store(&count, 0);
    refused = number ? atol(number) : 0;
}

__attribute__((destructor)) static void end(void) {
    long total = atomic_load(&count);
    FILE *file = report ? fopen(report, "w") : NULL;
    if (file) {
        fprintf(file, "%ld", total);
        fclose(file);
    }
}

static int is_refused(void) {
    return atomic_fetch_add(&count, 1) + 1 == refused;
}

void *malloc(size_t size) {
    return is_refused() ? (errno = ENOMEM, NULL) : __libc_malloc(size);
}

void *calloc(size_t number, size_t size) {
    return is_refused() ? (errno = ENOMEM, NULL) : __libc_calloc(number, size);
}

void *realloc(void *old, size_t size) {
    return is_refused() ? (errno = ENOMEM, NULL) : __libc_realloc(old, size);
}

void *aligned_alloc(size_t alignment, size_t size) {
    return is_refused() ? (errno = ENOMEM, NULL) : __libc_memalign(alignment, size);
}

int posix_memalign(void **place, size_t alignment, size_t size) {
    void *memory = is_refused() ? NULL : __libc_memalign(alignment, size);
    if (!memory)
        return ENOMEM;
    *place = memory;
    return 0;
}
