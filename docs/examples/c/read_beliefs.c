/* Prints what a running robot believes, and what it takes its partners to believe, with names.
 *
 *   cargo build --release -p reader
 *   cc -o read_beliefs docs/examples/c/read_beliefs.c -Ltarget/release -lleo_reader -Wl,-rpath,target/release
 *   ./read_beliefs /dev/shm/leo-NAME [ROUNDS]
 *
 * docs/beliefs.md explains the frames and the board of names. */
#define _POSIX_C_SOURCE 200809L

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "leo_reader.h"

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

static void print_name(const struct leo_name *name)
{
    printf("%.*s", (int)least(name->length, LEO_NAME_CAPACITY), (const char *)name->bytes);
}

/* The first percept of a belief with this kernel; NULL if there is none. */
static const struct leo_remembered *remembered(const struct leo_symbols *symbols, const struct leo_belief *belief,
                                               enum leo_percept_kernel kernel)
{
    for (uint32_t index = 0; index < least(belief->count, LEO_MAX_PERCEPTS); index++) {
        const struct leo_remembered *percept = &belief->percepts[index];
        if (percept->percept < least(symbols->percept_count, LEO_MAX_PERCEPTS) &&
            symbols->percepts[percept->percept].kernel == kernel)
            return percept;
    }
    return NULL;
}

/* Prints the name of the symbol of a percept with this kernel, and a space behind it. Returns whether there is one. */
static int print_symbol(const struct leo_symbols *symbols, const struct leo_belief *belief,
                        enum leo_percept_kernel kernel)
{
    const struct leo_remembered *percept = remembered(symbols, belief, kernel);
    if (percept == NULL || percept->feature_kind != LEO_FEATURE_KIND_SYMBOL)
        return 0;
    const struct leo_percept_description *description = &symbols->percepts[percept->percept];
    uint32_t number = (uint32_t)percept->feature[0];
    if (number < least(description->symbol_count, LEO_MAX_SYMBOLS)) {
        print_name(&description->symbols[number]);
    } else {
        print_name(&description->name);
        printf(" %" PRIu32, number);
    }
    putchar(' ');
    return 1;
}

/* Prints a belief: "3: yellow square at (0.50, 0.10, 0.02), seen 12 times, 0.1 s ago". */
static void print_belief(const struct leo_symbols *symbols, const struct leo_belief_head *head,
                         const struct leo_belief *belief)
{
    printf("  %" PRIu64 ": ", belief->id);
    int words = print_symbol(symbols, belief, LEO_PERCEPT_KERNEL_NEAREST_COLOUR);
    words += print_symbol(symbols, belief, LEO_PERCEPT_KERNEL_NEAREST_SHAPE);
    if (words == 0)
        printf("thing ");
    const struct leo_remembered *position = remembered(symbols, belief, LEO_PERCEPT_KERNEL_POSITION);
    /* In metres, in the frame of the perspective; the head has its pose. */
    if (position != NULL && position->feature_kind == LEO_FEATURE_KIND_VECTOR)
        printf("at (%.2f, %.2f, %.2f), ", position->feature[0], position->feature[1], position->feature[2]);
    double age_s = (double)(head->header.valid_at_ns - belief->perceived_at_ns) * 1e-9;
    printf("seen %" PRIu64 " times, %.1f s ago\n", belief->observations, age_s);
}

/* Prints the newest beliefs of a perspective. Returns 1, or 0 if there are no new ones. */
static int print_perspective(struct leo_reader *reader, uint32_t perspective, struct leo_symbols *symbols,
                             uint64_t *incarnation)
{
    struct leo_belief_head head;
    struct leo_text error;
    int64_t count = leo_reader_next(reader, perspective, &head, &error);
    if (count == LEO_READER_FAILED) {
        fprintf(stderr, "%.*s\n", (int)error.length, (const char *)error.bytes);
        exit(1);
    }
    if (count < 0)
        return 0;
    /* Another incarnation is a restarted process, with a board of its own. */
    if (head.header.incarnation != *incarnation) {
        if (!leo_reader_symbols(reader, head.header.incarnation, symbols))
            return 0;
        *incarnation = head.header.incarnation;
    }
    print_name(&symbols->agents[perspective]);
    puts(":");
    for (int64_t index = 0; index < count; index++) {
        struct leo_belief belief;
        if (leo_reader_belief(reader, (uint64_t)index, &belief))
            print_belief(symbols, &head, &belief);
    }
    return 1;
}

int main(int count, char **arguments)
{
    if (count < 2) {
        fprintf(stderr, "usage: read_beliefs /dev/shm/leo-NAME [ROUNDS]\n");
        return 2;
    }
    const char *domain = arguments[1];
    long rounds = count > 2 ? strtol(arguments[2], NULL, 10) : -1;
    struct leo_text error;
    struct leo_reader *reader = leo_reader_open(domain, &error);
    if (reader == NULL) {
        fprintf(stderr, "%.*s\n", (int)error.length, (const char *)error.bytes);
        return 1;
    }
    struct leo_symbols symbols = {0};
    uint64_t incarnation = 0;
    const struct timespec period = {0, 500000000};
    while (rounds != 0) {
        if (access(domain, F_OK) != 0) {
            fprintf(stderr, "the robot has ended\n");
            break;
        }
        uint32_t perspective = 0;
        do {
            if (print_perspective(reader, perspective, &symbols, &incarnation) && perspective == 0 && rounds > 0)
                rounds--;
            perspective++;
        } while (perspective < least(symbols.agent_count, LEO_MAX_PERSPECTIVES));
        fflush(stdout);
        nanosleep(&period, NULL);
    }
    leo_reader_close(reader);
    return 0;
}
