// Prints the probability that an Arduino Nano RP2040 Connect on a robot's foot is in stable contact.
#include <Arduino_LSM6DSOX.h>
#include <Wire.h>
#include <footfall_estimator.h>

static footfall_memory memory;
static footfall_estimator *estimator;

// The sensor's address, and its register of the accelerometer: 104 Hz, ±16 g, second filter on.
const uint8_t ADDRESS = 0x6A, CTRL1_XL = 0x10, RATE_104_HZ_RANGE_16_G = 0x46;

// The library sets ±4 g, which a heel strike exceeds, and takes its readings for such.
const float RANGE_G = 16, RANGE_OF_LIBRARY_G = 4;

// Readings from here on may be cut off.
const float SATURATED_G = 15.9F;

static bool set_range() {
  Wire.beginTransmission(ADDRESS);
  Wire.write(CTRL1_XL);
  Wire.write(RATE_104_HZ_RANGE_16_G);
  return Wire.endTransmission() == 0;
}

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
  if (!IMU.begin() || !set_range()) {
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
    force[axis] *= RANGE_G / RANGE_OF_LIBRARY_G;
    if (fabsf(force[axis]) > SATURATED_G) sample.validity = FOOTFALL_SAMPLE_ACCELEROMETER_SATURATED;
    force[axis] *= 9.80665F;
    rate[axis] *= 0.0174532925F;
  }
  sample.timestamp_us = now_us();
  footfall_estimate estimate;
  if (footfall_estimator_update(estimator, &sample, nullptr, &estimate) == FOOTFALL_OK) Serial.println(estimate.stable);
}
