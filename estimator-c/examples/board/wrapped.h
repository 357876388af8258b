/* The calls of the library that the linker's --wrap=SYMBOL redirects: a program calls __wrap_SYMBOL, which calls the library
 * by __real_SYMBOL. */
#ifndef WRAPPED_H
#define WRAPPED_H

#include "footfall_estimator.h"

footfall_error __real_footfall_estimator_init(void *, size_t, const footfall_params *, footfall_estimator **);
footfall_error __wrap_footfall_estimator_init(void *, size_t, const footfall_params *, footfall_estimator **);
footfall_error __real_footfall_estimator_update(footfall_estimator *, const footfall_sample *, const float *,
                                                footfall_estimate *);
footfall_error __wrap_footfall_estimator_update(footfall_estimator *, const footfall_sample *, const float *,
                                                footfall_estimate *);
footfall_error __real_footfall_estimator_learnt(const footfall_estimator *, footfall_learnt *);
footfall_error __wrap_footfall_estimator_learnt(const footfall_estimator *, footfall_learnt *);

#endif
