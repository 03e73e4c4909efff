/* SPDX-FileCopyrightText: The VLP calibration toolbox authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * C interface (C99) for the detection of lamps in images and for position fixes. Equations, frames
 * and sources are in lamps/lamp_detector.h and positioning/positioner.h; detections and fixes agree
 * with theirs to the last bit. Units: meters, radians, seconds, pixels. The world has z up, and yaw
 * is counter-clockwise seen from above. The center of an image's top left pixel is (0, 0).
 *
 * A field that is 0 is not given: callers set a struct to zero ({0}) and fill in the known fields.
 */
#ifndef VLP_VLP_H
#define VLP_VLP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Result of a call: the status of a fix as in FixStatus (positioning/fix.h), or, if negative, an
 * error. vlp_describe_status() describes each of them. */
enum {
  VLP_OK = 0,
  VLP_TOO_FEW_LAMPS = 1,     /* fewer than two lamps of the map */
  VLP_TOO_MANY_LAMPS = 2,    /* more than VLP_MAX_LAMPS */
  VLP_DUPLICATE_LAMP = 3,    /* one id twice in a frame */
  VLP_NOT_FINITE = 4,        /* a value is not finite, or a sigma, sd or prior is out of range */
  VLP_OUTSIDE_LENS = 5,      /* a pixel that no ray through the lens reaches */
  VLP_LAMP_BELOW_CAMERA = 6, /* a lamp would have to be at or below the camera's height */
  VLP_DEGENERATE = 7,        /* the lamps are too close together in the image, or fit no pose */
  VLP_AMBIGUOUS = 8,         /* two poses explain the lamps */
  VLP_INCONSISTENT = 9,      /* three lamps or more contradict each other */
  VLP_MIRRORED_MAP = 10,     /* the lamps fit a mirror image of the map */
  VLP_UNDETERMINED = 11,     /* lamps and priors do not determine motion or tilt, nor position */
  VLP_ROW_TIME_UNKNOWN = 12, /* motion, or lamps in an image, require the row time */
  VLP_BAD_FILE = -1,         /* a file cannot be read, or has invalid content */
  VLP_BAD_ARGUMENT = -2,     /* a null pointer, or a value out of range */
  VLP_NO_MEMORY = -3,
  VLP_FAILED = -4,   /* any other error; a defect of the library */
  VLP_TOO_SMALL = -5 /* an array is too small */
};

/* Maximum number of detections in a frame. */
#define VLP_MAX_LAMPS 256

/* Made once from lamp map and calibration; several threads may share it. */
typedef struct vlp_positioner vlp_positioner;

typedef struct vlp_options {
  /* Position of the camera in the robot's frame, which has z up, and its yaw relative to the
   * robot. With has_mount, fixes are of the robot's center; without, of the camera. */
  int32_t has_mount;
  double mount_position_m[3];
  double mount_yaw_rad;
  /* PositionerOptions::max_residual_fraction; 0: 0.1. */
  double max_residual_fraction;
  /* Standard deviation per axis of detections without sigma_px, in pixels; 0: 1. */
  double unstated_sigma_px;
} vlp_options;

/* A raw gray image in memory of the caller. */
typedef struct vlp_image {
  /* First pixel of the top row. 16-bit pixels have the machine's byte order and even addresses. */
  const void* data;
  /* Size in pixels; equal to that of the calibration. */
  int32_t width, height;
  /* Bytes from the start of a row to the start of the next; 0: rows are contiguous. */
  ptrdiff_t stride;
  /* Bits of a pixel in memory: 8 or 16. Use 16 for converters with 10 or 12 bits. */
  int32_t bits;
} vlp_image;

typedef struct vlp_detection {
  /* Id in the lamp map. */
  int32_t lamp;
  /* Center of the lamp. */
  double u_px, v_px;
  /* Standard deviation of the center per axis, 1e-4 to 1e3; 0 if unknown. */
  double sigma_px;
} vlp_detection;

/* State of the robot's center or, without a mount, of the camera, at the middle of the exposure of
 * the image's middle row. Covariances and derivatives have its nine numbers in this order. */
typedef struct vlp_state {
  double position_m[3];
  double yaw_rad;
  /* Along the axes of the level frame of the robot or, without a mount, of the camera. */
  double velocity_m_per_s[2];
  double yaw_rate_rad_per_s;
  /* Level is 0, as is a camera that looks straight down if the map states lamps_below_camera
   * (rig/lamp_map.h). */
  double roll_rad, pitch_rad;
} vlp_state;

/* Number of states in a covariance. */
#define VLP_STATES 9

/* Gaussian prior of the state: StatePrior of positioning/robot.h. */
typedef struct vlp_prior {
  vlp_state mean;
  /* Covariance by rows. An infinite variance of x, y, z or yaw states nothing. Variance 0 is exact.
   * Covariances with such states are ignored. */
  double covariance[VLP_STATES * VLP_STATES];
} vlp_prior;

/* Sensor readings of the robot for a frame: Sensors of positioning/positioner.h. */
typedef struct vlp_sensors {
  /* Any number, such as the time of the middle of the exposure of the image's middle row in
   * nanoseconds. Copied to vlp_fix.stamp. */
  int64_t stamp;
  /* Inclination about the axes of the robot or, without a mount, of the camera. */
  int32_t has_inclination;
  double roll_rad, pitch_rad;
  /* Standard deviation of roll_rad and pitch_rad, or, without a sensor, of roll and pitch about
   * level. If positive, roll and pitch are estimated with the pose. 0: exact. 1 or more: unknown.
   */
  double inclination_sigma_rad;
  /* Height and yaw of the camera and their standard deviations (0: exact), for fixes of one lamp.
   */
  int32_t has_height_and_yaw;
  double camera_z_m, camera_yaw_rad;
  double camera_z_sd_m, camera_yaw_sd_rad;
  /* Velocity in the level frame; standard deviations per component, 0: exact. */
  int32_t has_motion;
  double velocity_m_per_s[2];
  double yaw_rate_rad_per_s;
  double velocity_sd_m_per_s, yaw_rate_sd_rad_per_s;
  /* Height of the robot's center or, without a mount, of the camera. z_sd_m is positive. */
  int32_t has_height;
  double z_m, z_sd_m;
  /* Prior of the state in place of the readings above, or null. */
  const vlp_prior* prior;
} vlp_sensors;

/* An earlier frame of the same camera with the same velocity and yaw rate. */
typedef struct vlp_earlier_frame {
  const vlp_detection* detections;
  size_t count;
  /* Time from this frame to that of the fix. Positive, and different for each frame. */
  double before_s;
} vlp_earlier_frame;

/* A state that explains a frame, and its likelihood relative to the sum over all candidates. */
typedef struct vlp_candidate {
  vlp_state state;
  double likelihood;
} vlp_candidate;

typedef struct vlp_fix {
  /* Status of the fix, or error of vlp_locate_image(). The fields after `candidates` are zero
   * unless this is VLP_OK. */
  int32_t status;
  /* Number of detections whose id is not in the map; these are ignored. */
  int32_t unknown_lamps;
  int64_t stamp;
  /* States that explain the frame if the status is VLP_AMBIGUOUS, the most likely one first. */
  int32_t num_candidates;
  vlp_candidate candidates[6];
  /* States that vlp_sensors do not leave free are as given. */
  vlp_state state;
  /* Covariance of the state by rows, including all known errors. Zero for states given as exact. */
  double covariance[VLP_STATES * VLP_STATES];
  /* Part of the covariance that is independent between frames and averages out. */
  double noise_covariance[VLP_STATES * VLP_STATES];
  /* RMS distance in the image between the observed and the predicted lamps. */
  double residual_px;
  /* Sum of the squared residuals over their variances, and its degrees of freedom (Fix). */
  double chi_squared, redundancy;
  /* Number of lamps used for the fix; number of lamps rejected because the others contradict them,
   * and the ids of the first 32 of these. */
  int32_t lamps;
  int32_t rejected_lamps;
  int32_t rejected_ids[32];
} vlp_fix;

/* Use of a detection in a fix: DetectionUse of positioning/positioner.h. */
enum { VLP_USED = 0, VLP_REJECTED = 1, VLP_NOT_IN_MAP = 2 };

/* Comparison of a detection with a fix. */
typedef struct vlp_residual {
  int32_t use;
  /* Predicted pixel, and detected minus predicted pixel. NaN, as the derivatives, if the map lacks
   * the lamp or the lens does not image it. */
  double predicted_px[2];
  double residual_px[2];
  /* Derivatives of the predicted pixel with respect to the state, by rows. */
  double jacobian[2 * VLP_STATES];
} vlp_residual;

/* Returns the version of the library, such as "0.1.0". */
const char* vlp_version(void);

/* Creates a positioner from the two files; release it by vlp_close(). `options` may be null. On an
 * error `*positioner` is null. */
int32_t vlp_open(const char* lamps_yaml, const char* calibration_yaml, const vlp_options* options,
                 vlp_positioner** positioner);

/* Creates a positioner as vlp_open() does, from the lamps of one room of a map whose lamps state a
 * `room`. Null or "" takes all lamps. If lamps of two rooms then share a frequency, vlp_detect()
 * and vlp_locate_image() return VLP_BAD_FILE, and the names of the rooms are in vlp_last_error().
 */
int32_t vlp_open_room(const char* lamps_yaml, const char* room, const char* calibration_yaml,
                      const vlp_options* options, vlp_positioner** positioner);

/* Releases a positioner; a null pointer is ignored. */
void vlp_close(vlp_positioner* positioner);

/* Detects the lamps of the map that are fully inside an image, in order from the top, for
 * vlp_locate(). Writes the first `capacity` of them, and their number to `*count`. vlp_locate()
 * accepts up to VLP_MAX_LAMPS.
 *
 * Returns VLP_TOO_SMALL if there are more than `capacity`. After any other error `*count` is 0, and
 * vlp_last_error() describes the problem with the image. An image without lamps is no error.
 * Ignores lights that are no lamp of the map, and lamps that the image's edge cuts. Allocates heap
 * memory. Several threads may call it with one positioner. */
int32_t vlp_detect(const vlp_positioner* positioner, const vlp_image* image,
                   vlp_detection* detections, size_t capacity, size_t* count);

/* Detects the lamps of an image in the level plane, writes them as vlp_detect(), and computes the
 * fix of these detections. If roll and pitch are estimated, repeats the detection in the plane that
 * is level by the fix: lamps are discs in the level plane, and centers detected in another plane
 * are biased (locate_camera_in_image() in positioning/image_fix.h). `sensors` may be null. Returns
 * the status of the fix, or an error as vlp_detect(). */
int32_t vlp_locate_image(const vlp_positioner* positioner, const vlp_image* image,
                         const vlp_sensors* sensors, vlp_detection* detections, size_t capacity,
                         size_t* count, vlp_fix* fix);

/* Computes the fix of one frame and returns its status. `sensors` may be null. Allocates no
 * memory. */
int32_t vlp_locate(const vlp_positioner* positioner, const vlp_detection* detections, size_t count,
                   const vlp_sensors* sensors, vlp_fix* fix);

/* Computes the fix together with frames from shortly before. All frames determine one velocity, yaw
 * rate, roll and pitch (Positioner::compute_position_fix with EarlierFrame). Returns
 * VLP_TOO_MANY_LAMPS if the frames have more than VLP_MAX_LAMPS detections in total. */
int32_t vlp_locate_with_earlier(const vlp_positioner* positioner, const vlp_detection* detections,
                                size_t count, const vlp_sensors* sensors,
                                const vlp_earlier_frame* earlier, size_t earlier_count,
                                vlp_fix* fix);

/* Computes the pixel of a lamp of the map at a state, and its derivatives with respect to the state
 * by rows. `jacobian` may be null. Returns VLP_OUTSIDE_LENS if the lens does not image the lamp,
 * and VLP_BAD_ARGUMENT if the map lacks it. */
int32_t vlp_project(const vlp_positioner* positioner, int32_t lamp, const vlp_state* state,
                    double pixel[2], double jacobian[2 * VLP_STATES]);

/* Compares the detections of the frame of a fix with its state, and writes one residual for each.
 * `use` is exact for the rejected lamps that the fix lists. Returns VLP_BAD_ARGUMENT if the fix has
 * no state. */
int32_t vlp_compute_residuals(const vlp_positioner* positioner, const vlp_detection* detections,
                              size_t count, const vlp_fix* fix, vlp_residual* residuals);

/* Returns one line with the meaning of a status or an error and the remedy. Never null. */
const char* vlp_describe_status(int32_t code);

/* Returns the message of the last vlp_open(), vlp_open_room(), vlp_detect() or vlp_locate_image()
 * of this thread that failed: file, line and key, or the problem with the image, truncated to 1023
 * bytes. "" before the first failure. Valid until the next call of this thread. */
const char* vlp_last_error(void);

#ifdef __cplusplus
}
#endif

#endif
