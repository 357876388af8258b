// SPDX-License-Identifier: MIT OR Apache-2.0

#include "footfall_hardware/foot.hpp"

#include <cmath>
#include <limits>

namespace footfall_hardware
{
namespace
{

constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

/// The largest sigma_v, m/s: no information about the velocity.
constexpr double MOST_SIGMA = 100.0;

/// Age at which a rate no longer belongs to a contact, s. On CAN a rate comes each 20 ms.
constexpr double RATE_LASTS_S = 0.05;

double zero_or_one(bool is_one) {return is_one ? 1.0 : 0.0;}

/// Returns whether data received at `at_s` still count at `now_s`. If the clock was set back in between, they do not.
bool is_recent(double at_s, double now_s, double lasts_s)
{
  const double age_s = now_s - at_s;
  return age_s >= 0.0 && age_s <= lasts_s;
}

}  // namespace

Foot::Foot(uint8_t node, const VelocityParameters & velocity, double silent_after_s)
: node_(node), velocity_(velocity), silent_after_s_(silent_after_s)
{
}

void Foot::take(const footfall_frame & frame, double now_s)
{
  const auto & content = frame.content;
  switch (frame.kind) {
    case FOOTFALL_FRAME_KIND_CONTACT:
      contact_ = Contact{content.contact.stable_contact_probability, content.contact.status, now_s};
      break;
    case FOOTFALL_FRAME_KIND_RATE:
      take_rate(
        content.rate.rate_x_rad_s, content.rate.rate_y_rad_s, content.rate.rate_z_rad_s, now_s);
      break;
    default:
      break;
  }
}

void Foot::take(const footfall_message & message, double now_s)
{
  const auto & content = message.content;
  switch (message.kind) {
    case FOOTFALL_MESSAGE_KIND_CONTACT:
      contact_ = Contact{content.contact.stable_contact_probability, content.contact.status, now_s};
      break;
    case FOOTFALL_MESSAGE_KIND_RAW:
      if (content.raw.validity == FOOTFALL_VALIDITY_VALID) {
        take_rate(
          content.raw.angular_rate_x_rad_s, content.raw.angular_rate_y_rad_s,
          content.raw.angular_rate_z_rad_s, now_s);
      }
      break;
    case FOOTFALL_MESSAGE_KIND_HEALTH:
      wrong_node_ = node_ != 0 && content.health.node != node_ ? content.health.node : 0;
      break;
    default:
      break;
  }
}

void Foot::take_rate(float x, float y, float z, double now_s)
{
  const double squared = double{x} * x + double{y} * y + double{z} * z;
  if (std::isfinite(squared)) {
    rate_ = Rate{squared, now_s};
  }
}

double Foot::sigma_v(double now_s) const
{
  if (!contact_->status.valid || !(contact_->p_stable > 0.0)) {
    return MOST_SIGMA;
  }
  if (!rate_ || !is_recent(rate_->at_s, now_s, RATE_LASTS_S)) {
    return MOST_SIGMA;
  }
  const double odds_against = (1.0 - contact_->p_stable) / contact_->p_stable;
  const double of_odds = velocity_.speed * odds_against;
  const double of_turn = velocity_.lever * velocity_.lever * rate_->squared;
  const double variance = of_odds * of_odds + of_turn + velocity_.floor * velocity_.floor;
  return std::fmin(std::sqrt(variance), MOST_SIGMA);
}

FootValues Foot::values(double now_s) const
{
  if (!contact_ || wrong_node_ != 0) {
    return {UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN};
  }
  if (!is_recent(contact_->at_s, now_s, silent_after_s_)) {
    return {0.0, 0.0, MOST_SIGMA, UNKNOWN};
  }
  const auto & status = contact_->status;
  const bool stands = status.valid && status.decision == FOOTFALL_DECISION_STABLE;
  const bool has_state = status.valid && status.state != FOOTFALL_STATE_UNKNOWN;
  return {
    zero_or_one(stands),
    status.valid ? contact_->p_stable : 0.0,
    sigma_v(now_s),
    has_state ? zero_or_one(status.state == FOOTFALL_STATE_SLIP) : UNKNOWN,
  };
}

}  // namespace footfall_hardware
