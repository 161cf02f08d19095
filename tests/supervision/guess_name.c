/* Creates a file at a name of shared memory just before a process does, as a user who guessed the name would.
 * LD_PRELOAD this library with LEO_GUESSES=FOLDER. The next process that starts removes FOLDER/next, which contains a
 * number: the file is created before that creation of the process. Its name is written to FOLDER/guessed. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long count;
static long guessed;

static const char *in_folder(const char *name) {
    static char path[4096];
    snprintf(path, sizeof path, "%s/%s", getenv("LEO_GUESSES"), name);
    return path;
}

__attribute__((constructor)) static void begin(void) {
    if (!getenv("LEO_GUESSES"))
        return;
    FILE *next = fopen(in_folder("next"), "r");
    if (!next)
        return;
    long number = 0;
    int read = fscanf(next, "%ld", &number);
    fclose(next);
    /* Only one process removes it. */
    if (read == 1 && unlink(in_folder("next")) == 0)
        guessed = number;
}

int shm_open(const char *name, int flags, mode_t mode) {
    int (*real)(const char *, int, mode_t) = (int (*)(const char *, int, mode_t))dlsym(RTLD_NEXT, "shm_open");
    if ((flags & O_CREAT) && (flags & O_EXCL) && guessed && atomic_fetch_add(&count, 1) + 1 == guessed) {
        int file = real(name, O_CREAT | O_EXCL | O_RDWR, 0600);
        FILE *told = fopen(in_folder("guessed"), "w");
        /* Without the right to give it away, the file stays this user's. With a byte in it, it seems complete. */
        if (file < 0 || !told || write(file, "x", 1) != 1 || (fchown(file, 65534, 65534) && geteuid() == 0))
            abort();
        fprintf(told, "%s", name);
        fclose(told);
        close(file);
    }
    return real(name, flags, mode);
}
