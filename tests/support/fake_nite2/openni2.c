/* The functions of OpenNI2 that a skeleton source calls, for one sensor "fake://0". */
#include <string.h>

#include "fake.h"

typedef struct {
  char uri[256], vendor[256], name[256];
  unsigned short usb_vendor_id, usb_product_id;
} DeviceInfo;

static int initialized, devices_open;

int oniInitialize(int api_version) {
  if (api_version / 1000 != 2) return 1;
  initialized++;
  return 0;
}

void oniShutdown(void) { initialized--; }

const char *oniGetExtendedError(void) { return is_plugged() ? "" : "\tno device was found\n"; }

int oniGetDeviceList(DeviceInfo **infos, int *count) {
  if (initialized != 1) return 1;
  *count = is_plugged();
  *infos = calloc(1, sizeof(DeviceInfo));
  strcpy((*infos)->uri, "fake://0");
  return 0;
}

int oniReleaseDeviceList(DeviceInfo *infos) {
  free(infos);
  return 0;
}

int oniDeviceOpen(const char *uri, void **device) {
  if (initialized != 1 || !is_plugged() || strcmp(uri, "fake://0") != 0) return 6;
  *device = &devices_open;
  devices_open++;
  return 0;
}

int oniDeviceClose(void *device) {
  devices_open -= device == &devices_open;
  return 0;
}

/* For the test alone. */
int fake_open_devices(void) { return devices_open; }
int fake_initialized(void) { return initialized; }
