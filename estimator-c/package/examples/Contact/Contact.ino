// Prints the probability that an Arduino Nano RP2040 Connect on a robot's foot is in stable contact.
#include <Arduino_LSM6DSOX.h>
#include <footfall_estimator.h>

static footfall_memory memory;
static footfall_estimator *estimator;

// micros() with 64 bits: it starts again after 71 minutes.
static uint64_t now_us() {
  static uint32_t before;
  static uint64_t high;
  const uint32_t low = micros();
  if (low < before) high += UINT64_C(1) << 32;
  before = low;
  return high + low;
}

void setup() {
  Serial.begin(115200);
  footfall_params params;
  footfall_default_params(&params);
  if (!IMU.begin()) {
    for (;;) Serial.println("no IMU");
  }
  params.sample_rate_hz = IMU.accelerationSampleRate();
  const footfall_error error = footfall_estimator_init(&memory, sizeof memory, &params, &estimator);
  while (error != FOOTFALL_OK) Serial.println(footfall_error_text(error));
}

void loop() {
  if (!IMU.accelerationAvailable() || !IMU.gyroscopeAvailable()) return;
  footfall_sample sample = {};
  float *force = sample.specific_force_m_s2, *rate = sample.angular_rate_rad_s;
  IMU.readAcceleration(force[0], force[1], force[2]); // g
  IMU.readGyroscope(rate[0], rate[1], rate[2]);       // degrees per second
  for (int axis = 0; axis < 3; axis++) {
    force[axis] *= 9.80665F;
    rate[axis] *= 0.0174532925F;
  }
  sample.timestamp_us = now_us();
  footfall_estimate estimate;
  if (footfall_estimator_update(estimator, &sample, nullptr, &estimate) == FOOTFALL_OK) Serial.println(estimate.stable);
}
