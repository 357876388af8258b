// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef FOOTFALL_HARDWARE__FOOT_HPP_
#define FOOTFALL_HARDWARE__FOOT_HPP_

#include <cstdint>
#include <optional>

#include "footfall.h"

namespace footfall_hardware
{

/// Parameters of sigma_v; the settings `velocity.speed`, `velocity.lever` and `velocity.floor` of footfall.
struct VelocityParameters
{
  /// Standard deviation at a probability of 0.5, m/s.
  double speed = 0.05;
  /// Distance between the IMU and the point about which a standing foot turns, m.
  double lever = 0.15;
  /// Least standard deviation, m/s.
  double floor = 0.003;
};

/// State interfaces of a foot. All are NaN before its first contact.
struct FootValues
{
  /// 1 while the foot stands firmly, by its debounced decision; else 0.
  double contact;
  /// Probability of stable contact, 0 to 1; 0 if it is not valid.
  double p_stable;
  /// Standard deviation of the foot's velocity about zero, each axis, m/s; 100 if nothing is known.
  double sigma_v;
  /// 1 while the loaded foot slips, else 0; NaN if the foot does not know its load.
  double slip;
};

/// Newest state of a foot. Times are in seconds, on one clock. If the clock is set back, as a simulated clock is at a restart, the
/// foot is silent until its next contact.
class Foot
{
public:
  /// `node` is the expected node id of the board; 0 accepts any. A foot without a contact for `silent_after_s` is silent.
  Foot(uint8_t node, const VelocityParameters & velocity, double silent_after_s);

  /// Processes a CAN frame of this foot.
  void take(const footfall_frame & frame, double now_s);

  /// Processes a message of the serial line of this foot.
  void take(const footfall_message & message, double now_s);

  /// Returns the values at a time. A foot that is silent or has no valid data does not stand.
  FootValues values(double now_s) const;

  /// Expected node id, or 0.
  uint8_t node() const {return node_;}

  /// Returns the node id that the board has instead of the expected one, or 0. With another id, the values are NaN.
  uint8_t wrong_node() const {return wrong_node_;}

private:
  struct Contact
  {
    double p_stable;
    footfall_status status;
    double at_s;
  };

  struct Rate
  {
    /// Square of the angular rate, rad²/s².
    double squared;
    double at_s;
  };

  void take_rate(float x, float y, float z, double now_s);
  double sigma_v(double now_s) const;

  uint8_t node_;
  VelocityParameters velocity_;
  double silent_after_s_;
  uint8_t wrong_node_ = 0;
  std::optional<Contact> contact_;
  std::optional<Rate> rate_;
};

}  // namespace footfall_hardware

#endif  // FOOTFALL_HARDWARE__FOOT_HPP_
