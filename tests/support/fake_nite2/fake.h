/* What both fake libraries share. The sensor is a text file, one line a frame:
   timestamp [us], then for each user: id, user state, skeleton state, 15 * (x y z confidence).
   It is plugged in as long as the file exists that FAKE_NITE_PLUGGED names. */
#pragma once
#include <stdint.h>
#include <stdlib.h>
#include <unistd.h>

#define JOINTS 15

static inline int is_plugged(void) {
  const char *path = getenv("FAKE_NITE_PLUGGED");
  return path != NULL && access(path, F_OK) == 0;
}
