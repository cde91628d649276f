/* The functions of NiTE2 that a skeleton source calls; a thread plays the recording.
   A user's skeleton is given only once tracking was started for it. */
#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include "fake.h"

typedef struct { float x, y, z; } Point;
typedef struct {
  int type;
  Point position;
  float position_confidence;
  float orientation[4], orientation_confidence;
} Joint;
typedef struct { Joint joints[JOINTS]; int state; } Skeleton;
typedef struct {
  short id;
  Point box[2], center;
  int state;
  Skeleton skeleton;
  struct { int type, state; } poses[2];
} User;
typedef struct {
  int user_count;
  User *users;
  struct { short *pixels; int width, height, stride; } map;
  void *depth_frame;
  unsigned long long timestamp;
  int frame_index;
  float floor_confidence;
  Point floor[2];
} Frame;
typedef struct { void (*ready)(void *); } Callbacks;
typedef struct {
  pthread_t thread;
  pthread_mutex_t lock;
  int ends, is_started[256], index;
  Callbacks *callbacks;
  void *cookie;
  Frame newest;
  User users[8];
} Tracker;

static int initialized, frames_out;

int niteInitialize(void) {
  initialized++;
  return 0;
}

void niteShutdown(void) { initialized--; }

static void read_user(Tracker *tracker, User *user, char **rest) {
  memset(user, 0, sizeof *user);
  user->id = (short)strtol(*rest, rest, 10);
  user->state = (int)strtol(*rest, rest, 10);
  user->skeleton.state = (int)strtol(*rest, rest, 10);
  if (!tracker->is_started[user->id & 255]) user->skeleton.state = 0;
  for (int j = 0; j < JOINTS; j++) {
    Joint *joint = &user->skeleton.joints[j];
    joint->type = j;
    joint->position.x = strtof(*rest, rest);
    joint->position.y = strtof(*rest, rest);
    joint->position.z = strtof(*rest, rest);
    joint->position_confidence = strtof(*rest, rest);
  }
}

static void play_line(Tracker *tracker, char *line) {
  char *rest = line;
  pthread_mutex_lock(&tracker->lock);
  Frame *frame = &tracker->newest;
  memset(frame, 0, sizeof *frame);
  frame->timestamp = strtoull(rest, &rest, 10);
  frame->frame_index = ++tracker->index;
  frame->users = tracker->users;
  while (frame->user_count < 8 && rest[strspn(rest, " \n")] != '\0')
    read_user(tracker, &tracker->users[frame->user_count++], &rest);
  Callbacks *callbacks = tracker->callbacks;
  void *cookie = tracker->cookie;
  pthread_mutex_unlock(&tracker->lock);
  if (callbacks != NULL) callbacks->ready(cookie);
}

static void *play(void *argument) {
  Tracker *tracker = argument;
  static char line[65536];
  while (!tracker->ends) {
    FILE *file = fopen(getenv("FAKE_NITE_RECORDING"), "r");
    while (file != NULL && !tracker->ends && is_plugged() && fgets(line, sizeof line, file)) {
      play_line(tracker, line);
      usleep(20000);
    }
    if (file != NULL) fclose(file);
    usleep(20000);
  }
  return NULL;
}

int niteInitializeUserTracker(void **handle) {
  if (initialized != 1 || !is_plugged()) return 1;
  Tracker *tracker = calloc(1, sizeof(Tracker));
  pthread_mutex_init(&tracker->lock, NULL);
  pthread_create(&tracker->thread, NULL, play, tracker);
  *handle = tracker;
  return 0;
}

/* The argument is a C++ object whose second pointer is the device's handle. */
int niteInitializeUserTrackerByDevice(void *device, void **handle) {
  return ((void **)device)[1] == NULL ? 1 : niteInitializeUserTracker(handle);
}

int niteShutdownUserTracker(void *handle) {
  Tracker *tracker = handle;
  tracker->ends = 1;
  pthread_join(tracker->thread, NULL);
  free(tracker);
  return 0;
}

int niteStartSkeletonTracking(void *handle, short id) {
  Tracker *tracker = handle;
  tracker->is_started[id & 255] = 1;
  return 0;
}

int niteReadUserTrackerFrame(void *handle, Frame **frame) {
  Tracker *tracker = handle;
  pthread_mutex_lock(&tracker->lock);
  *frame = malloc(sizeof(Frame));
  **frame = tracker->newest;
  (*frame)->users = malloc(sizeof tracker->users);
  memcpy((*frame)->users, tracker->users, sizeof tracker->users);
  pthread_mutex_unlock(&tracker->lock);
  frames_out++;
  return 0;
}

int niteUserTrackerFrameRelease(void *handle, Frame *frame) {
  (void)handle;
  free(frame->users);
  free(frame);
  frames_out--;
  return 0;
}

int niteRegisterUserTrackerCallbacks(void *handle, Callbacks *callbacks, void *cookie) {
  Tracker *tracker = handle;
  pthread_mutex_lock(&tracker->lock);
  tracker->callbacks = callbacks;
  tracker->cookie = cookie;
  pthread_mutex_unlock(&tracker->lock);
  return 0;
}

int niteUnregisterUserTrackerCallbacks(void *handle, Callbacks *callbacks) {
  (void)callbacks;
  return niteRegisterUserTrackerCallbacks(handle, NULL, NULL);
}

/* For the test alone. */
int fake_frames_out(void) { return frames_out; }
