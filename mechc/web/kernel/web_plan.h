/* What a model adds to the kernel of a page (compiler/targets/wasm/plan.py). */
#ifndef WEB_PLAN_H
#define WEB_PLAN_H

#include "model.h"
#include "start.h"

#define EXPORT(name) __attribute__((export_name(#name))) name

enum { IN_P, IN_Y, IN_U };

typedef struct web_setting {
    int array;             /* IN_P, IN_Y or IN_U                                                */
    int index, guess;
} web_setting;

/* The model, the sizes of its states, its functions of the picture, and what is evaluated of an experiment. */
typedef struct web_plan {
    const mech_model *model;
    const mech_sizes *sizes;
    int n_still, n_moving;          /* numbers of the picture                                  */
    mech_function *still, *moving;
    int n_settings, n_numbers;
    mech_function *experiment;      /* out[n_numbers + n_settings]; NULL: there is none        */
    const web_setting *settings;
} web_plan;

extern const web_plan *web_slot;

#endif
