/* SPDX-FileCopyrightText: The VLP calibration toolbox authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Lamps in images and fixes from them in C (C99), for every language that can call it. What is
 * behind it, equations, frames and sources included, is in lamps/lamp_detector.h and
 * positioning/positioner.h; detections and fixes are the same to the last bit. Metres, radians,
 * seconds, pixels; the world has z up, yaw is counter-clockwise seen from above, and the centre of
 * an image's top left pixel is (0, 0).
 *
 * A field that is 0 is not stated: of structs that are zero ({0}) a caller fills in what it knows.
 */
#ifndef VLP_VLP_H
#define VLP_VLP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a call says: how a fix went, as FixStatus (positioning/fix.h) has it, or, below zero, why
 * there is none to speak of. vlp_explanation() tells each in words. */
enum {
  VLP_OK = 0,
  VLP_TOO_FEW_LAMPS = 1,     /* fewer than two lamps of the map */
  VLP_TOO_MANY_LAMPS = 2,    /* more than VLP_MAX_LAMPS */
  VLP_DUPLICATE_LAMP = 3,    /* one id twice in a frame */
  VLP_NOT_FINITE = 4,        /* a pixel or a reading is not, or a sigma or sd is out of range */
  VLP_OUTSIDE_LENS = 5,      /* a pixel that no ray through the lens reaches */
  VLP_LAMP_BELOW_CAMERA = 6, /* a lamp would have to hang at or below the camera's height */
  VLP_DEGENERATE = 7,        /* the lamps are seen too close together, or do not fit any pose */
  VLP_AMBIGUOUS = 8,         /* two poses would explain the lamps */
  VLP_INCONSISTENT = 9,      /* three lamps or more that contradict each other */
  VLP_MIRRORED_MAP = 10,     /* they fit a mirror image of the map */
  VLP_UNDETERMINED = 11,     /* what is known does not tell lean or motion, and so not the place */
  VLP_ROW_TIME_UNKNOWN = 12, /* motion, or lamps in an image, need the time when a row is read */
  VLP_BAD_FILE = -1,         /* a file cannot be read, or holds what it should not */
  VLP_BAD_ARGUMENT = -2,     /* a null pointer, or a figure out of range */
  VLP_NO_MEMORY = -3,
  VLP_FAILED = -4,   /* anything else; a mistake in the library */
  VLP_TOO_SMALL = -5 /* an array has no room for all */
};

/* Detections in a frame. */
#define VLP_MAX_LAMPS 256

/* Made once from lamp map and calibration; any number of threads may share it. */
typedef struct vlp_positioner vlp_positioner;

typedef struct vlp_options {
  /* With has_mount, fixes are of the robot's centre: where the camera stands on the robot, whose
   * frame has z up, and by how much its yaw is turned against the robot's. Without, of the camera.
   */
  int32_t has_mount;
  double mount_position_m[3];
  double mount_yaw_rad;
  /* PositionerOptions::max_residual_share, 0.1 when 0. */
  double max_residual_share;
  /* Standard deviation per axis of detections that state none, in pixels; 1 when 0. */
  double unstated_sigma_px;
} vlp_options;

/* A grey image as the camera took it, in memory of the caller. */
typedef struct vlp_image {
  /* First pixel of the top row. Pixels of 16 bits are in the machine's byte order, at even
   * addresses. */
  const void* data;
  /* Pixels; those of the calibration. */
  int32_t width, height;
  /* Bytes from the start of a row to the start of the next; 0: rows follow without a gap. */
  ptrdiff_t stride;
  /* Of a pixel in memory: 8 or 16. 10 or 12 bits of a converter are 16 here. */
  int32_t bits;
} vlp_image;

typedef struct vlp_detection {
  /* Id in the lamp map. */
  int32_t lamp;
  /* The lamp's centre. */
  double u_px, v_px;
  /* Its standard deviation per axis, 1e-4 to 1e3; 0 when it is not stated. */
  double sigma_px;
} vlp_detection;

/* What a robot knows of a frame besides the image: Sensors of positioning/positioner.h. */
typedef struct vlp_sensors {
  /* Any figure, such as nanoseconds of the middle of the exposure of the image's middle row. It
   * comes back as it is. */
  int64_t stamp;
  /* About the axes of the robot or, without a mount, of the camera. */
  int32_t has_inclination;
  double roll_rad, pitch_rad;
  /* Of each of the two, or of a lean about level that no sensor reads: with two lamps or more roll
   * and pitch are then estimated. 0: just so. 1 or more: nothing is known. */
  double inclination_sigma_rad;
  /* Height and yaw of the camera and their standard deviations (0: exact), for fixes of one lamp.
   */
  int32_t has_height_and_yaw;
  double camera_z_m, camera_yaw_rad;
  double camera_z_sd_m, camera_yaw_sd_rad;
  /* Velocity in the level frame; standard deviations per component, 0: just so. */
  int32_t has_motion;
  double velocity_m_per_s[2];
  double yaw_rate_rad_per_s;
  double velocity_sd_m_per_s, yaw_rate_sd_rad_per_s;
  /* Of the robot's centre or, without a mount, of the camera; its standard deviation is positive.
   */
  int32_t has_height;
  double z_m, z_sd_m;
} vlp_sensors;

/* A frame that the same camera saw shortly before, on the same straight way. */
typedef struct vlp_earlier_frame {
  const vlp_detection* detections;
  size_t count;
  /* Time from this frame to that of the fix. */
  double before_s;
} vlp_earlier_frame;

typedef struct vlp_fix {
  /* As vlp_locate() gave it. What follows `stamp` is zero unless this is VLP_OK. */
  int32_t status;
  /* Detections whose id is not in the map; they are left out. */
  int32_t unknown_lamps;
  int64_t stamp;
  /* Of the robot's centre or, without a mount, of the camera. */
  double position_m[3];
  /* Estimated where vlp_sensors let it lean, else as given; level is 0. */
  double roll_rad, pitch_rad;
  double yaw_rad;
  /* Of (x, y, z, roll, pitch, yaw), by rows: all that is known of the fix's error. Where the lean
   * is not estimated, roll and pitch have the variance of vlp_sensors.inclination_sigma_rad and no
   * correlation stated; 0 if that is 0, which takes the camera as exactly level or exactly read. */
  double covariance[36];
  /* The part that is of this frame alone and averages out. */
  double noise_covariance[36];
  /* In the world; estimated where vlp_sensors let it move, else zero or as given. */
  double velocity_m_per_s[2];
  double yaw_rate_rad_per_s;
  /* Of (vx, vy, yaw rate), by rows: all that is known of their error. */
  double velocity_covariance[9];
  /* Root of the mean squared distance of the lamps' pixels from where the fix sees them. */
  double residual_px;
  /* That the fix rests on; that were left out because the others contradict them, and the ids of
   * the first 32 of those. */
  int32_t lamps;
  int32_t rejected_lamps;
  int32_t rejected_ids[32];
} vlp_fix;

/* Of the library, such as "0.1.0". */
const char* vlp_version(void);

/* Reads the two files and makes a positioner of them, to be closed; `options` may be null. On an
 * error `*positioner` is null. */
int32_t vlp_open(const char* lamps_yaml, const char* calibration_yaml, const vlp_options* options,
                 vlp_positioner** positioner);

/* Does what vlp_open() does, with the lamps of one room of a map whose lamps state a `room`. Null
 * or
 * "" takes all lamps, as vlp_open() does. If lamps of two rooms then share a frequency,
 * vlp_detect() returns VLP_BAD_FILE, and the names of the rooms are in vlp_last_error(). */
int32_t vlp_open_room(const char* lamps_yaml, const char* room, const char* calibration_yaml,
                      const vlp_options* options, vlp_positioner** positioner);

/* Null is none. */
void vlp_close(vlp_positioner* positioner);

/* Detects the lamps of the map that are wholly in an image, from the top, for vlp_locate(). Writes
 * the first `capacity` of them, of which vlp_locate() takes VLP_MAX_LAMPS, and their number to
 * `*count`; if that is more than `capacity`, returns VLP_TOO_SMALL. After any other error `*count`
 * is 0; what is wrong with the image is in vlp_last_error(). An image without lamps is no error.
 * Lights that are no lamp of the map, and lamps that the image's edge cuts, are left out. Takes
 * memory from the heap. Any number of threads may call it with one positioner. */
int32_t vlp_detect(const vlp_positioner* positioner, const vlp_image* image,
                   vlp_detection* detections, size_t capacity, size_t* count);

/* The fix of one frame, and its status; `sensors` may be null. It allocates nothing. */
int32_t vlp_locate(const vlp_positioner* positioner, const vlp_detection* detections, size_t count,
                   const vlp_sensors* sensors, vlp_fix* fix);

/* As vlp_locate(), with frames from shortly before, which determine one velocity, yaw rate and lean
 * together with this one (Positioner::locate with EarlierFrame). VLP_TOO_MANY_LAMPS if the frames
 * have more than VLP_MAX_LAMPS detections in total. */
int32_t vlp_locate_with_earlier(const vlp_positioner* positioner, const vlp_detection* detections,
                                size_t count, const vlp_sensors* sensors,
                                const vlp_earlier_frame* earlier, size_t earlier_count,
                                vlp_fix* fix);

/* What a status or an error means and what to do, in a line. Never null. */
const char* vlp_explanation(int32_t code);

/* What went wrong in the last vlp_open(), vlp_open_room() or vlp_detect() of this thread that
 * failed: file, line, key, or what the image is; "" before. Valid until its next call. */
const char* vlp_last_error(void);

#ifdef __cplusplus
}
#endif

#endif
