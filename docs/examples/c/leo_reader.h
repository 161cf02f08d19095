/* Reads what a running robot believes, and the names of what beliefs refer to by number; for C and C++.
 *
 * The library is `libleo_reader.so`: `cargo build --release -p reader` makes it in target/release.
 * docs/beliefs.md says how to use it. A reader is for one thread, and a process can open one robot only. */
#ifndef LEO_READER_H
#define LEO_READER_H

#include "leo_messages.h"

#ifdef __cplusplus
extern "C" {
#endif

struct leo_reader;

/* Results of `leo_reader_next` without a frame. */
#define LEO_READER_NOTHING_NEW (-1)
#define LEO_READER_FAILED (-2)

/* Joins the domain of a robot, such as "/dev/shm/leo-NAME". NULL on failure; then `error`, which may be NULL,
 * contains the reason. `leo_reader_close` frees the reader. */
struct leo_reader *leo_reader_open(const char *domain, struct leo_text *error);

/* Takes the newest frame of beliefs of a perspective: 0 the robot's, n that of partner n. Writes its head and returns
 * its number of beliefs, or LEO_READER_NOTHING_NEW, also while no process publishes the perspective. The frame lasts
 * until the next call. On LEO_READER_FAILED `error`, which may be NULL, contains the reason. */
int64_t leo_reader_next(struct leo_reader *reader, uint32_t perspective, struct leo_belief_head *head,
                        struct leo_text *error);

/* Writes a belief of the newest frame taken, by its index from 0. Returns 1, or 0 if there is no such belief. */
int32_t leo_reader_belief(const struct leo_reader *reader, uint64_t index, struct leo_belief *belief);

/* Writes the names that beliefs refer to whose `header.incarnation` this is. Returns 1, or 0 if that incarnation of
 * the belief process has no board of names, or has ended. */
int32_t leo_reader_symbols(struct leo_reader *reader, uint64_t incarnation, struct leo_symbols *symbols);

/* Leaves the domain, and frees the reader; NULL is allowed. */
void leo_reader_close(struct leo_reader *reader);

#ifdef __cplusplus
}
#endif

#endif
