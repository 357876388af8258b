/* The name that the Arduino IDE expects of the library "Footfall". */
#include "footfall_estimator.h"
