/* SPDX-FileCopyrightText: The VLP calibration toolbox authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Lamps of one room of a map of two rooms through the C API: prints the number of lamps in an
 * image, or the error. The image, of 800 x 600 pixels, is read from stdin.
 */
#include <stdint.h>
#include <stdio.h>
#include <vlp/vlp.h>

static uint8_t pixels[600][800];

/* Prints the lamps of the room in the image. */
static void print_lamps(const char* room, const vlp_image* image) {
  vlp_positioner* positioner;
  vlp_detection seen[VLP_MAX_LAMPS];
  size_t count = 0;
  if (vlp_open_room("rooms.yaml", room, "calibration.yaml", NULL, &positioner) != VLP_OK ||
      vlp_detect(positioner, image, seen, VLP_MAX_LAMPS, &count) != VLP_OK) {
    printf("%s\n", vlp_last_error());
  } else {
    printf("%d lamps, the first is %d\n", (int)count, (int)seen[0].lamp);
  }
  vlp_close(positioner);
}

int main(void) {
  const vlp_image image = {pixels, 800, 600, 0, 8};
  if (fread(pixels, sizeof pixels, 1, stdin) != 1) return 1;
  print_lamps("hall", &image);
  print_lamps("office", &image);
  print_lamps("attic", &image);
  print_lamps(NULL, &image);
  return 0;
}
