/* One instance of the model: its values, its steps, and copies of its state. The same for FMI 2 and FMI 3.

   A value reference is the place of a number in `values`: the time, the parameters, the initial states, the inputs,
   the outputs and the states, one after the other. Which is where, model.h says. */

#ifndef DT_INSTANCE_H
#define DT_INSTANCE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#if defined(_WIN32)
#define DT_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define DT_EXPORT __attribute__((visibility("default")))
#else
#define DT_EXPORT
#endif

/* The same numbers in FMI 2 and FMI 3. */
enum { DT_OK = 0, DT_ERROR = 3 };

enum { DT_INSTANTIATED, DT_INITIALISING, DT_STEPPING, DT_TERMINATED };

/* Share of the period by which a communication step may miss its end by rounding. */
#define DT_ROUNDING 1e-6

typedef struct {
    double values[MODEL_VALUES];
    double start_time;
    double steps; /* periods since the start */
    int phase;
    int known; /* whether outputs (and states, before the first step) follow what was set last */
} DtMemory;

typedef struct DtInstance {
    DtMemory memory;
    char *name;
    void *environment;
    void (*log)(struct DtInstance *instance, const char *message);
    void (*logger)(void); /* callback of the importer, of the type that its FMI version says */
} DtInstance;

/* What a serialised state begins with, so that one of another model is not taken for this one's. */
typedef struct {
    char token[sizeof MODEL_TOKEN];
    DtMemory memory;
} DtSerialised;

static int dt_error(DtInstance *instance, const char *message)
{
    if (instance->log) instance->log(instance, message);
    return DT_ERROR;
}

static void dt_reset(DtInstance *instance)
{
    memset(&instance->memory, 0, sizeof instance->memory);
    memcpy(instance->memory.values, model_start, sizeof instance->memory.values);
    instance->memory.phase = DT_INSTANTIATED;
}

static DtInstance *dt_new(const char *name)
{
    DtInstance *instance = calloc(1, sizeof *instance);
    if (!instance) return NULL;
    name = name ? name : "";
    instance->name = calloc(strlen(name) + 1, 1);
    if (!instance->name) {
        free(instance);
        return NULL;
    }
    strcpy(instance->name, name);
    dt_reset(instance);
    return instance;
}

static void dt_free(DtInstance *instance)
{
    if (!instance) return;
    free(instance->name);
    free(instance);
}

/* The time is multiplied out, so that no rounding adds up over the steps. */
static double dt_time(const DtMemory *m)
{
    return m->start_time + m->steps * MODEL_PERIOD;
}

/* Bring what is read in line with what was set: before the first step the states too, later the outputs alone. */
static void dt_refresh(DtMemory *m)
{
    if (m->known) return;
    double *v = m->values;
    v[0] = dt_time(m);
    if (m->phase <= DT_INITIALISING) model_initial(v + MODEL_PARAMETERS, v + MODEL_INITIAL, v + MODEL_STATES);
    model_outputs(v + MODEL_PARAMETERS, v + MODEL_STATES, v + MODEL_INPUTS, v, v + MODEL_OUTPUTS);
    m->known = 1;
}

static int dt_get(DtInstance *instance, const uint32_t *references, size_t count, double *values)
{
    dt_refresh(&instance->memory);
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= MODEL_VALUES) return dt_error(instance, "A value reference is unknown: nothing was read.");
        values[i] = instance->memory.values[references[i]];
    }
    return DT_OK;
}

static int dt_set(DtInstance *instance, const uint32_t *references, size_t count, const double *values)
{
    DtMemory *m = &instance->memory;
    for (size_t i = 0; i < count; ++i) {
        char access = references[i] < MODEL_VALUES ? model_access[references[i]] : DT_READ_ONLY;
        if (access == DT_READ_ONLY)
            return dt_error(instance, "A variable that is no input and no parameter was to be set: nothing was set.");
        if (access == DT_FIXED && m->phase >= DT_STEPPING)
            return dt_error(instance, "A fixed parameter was to be set after the initialisation: nothing was set.");
    }
    for (size_t i = 0; i < count; ++i) m->values[references[i]] = values[i];
    m->known = 0;
    return DT_OK;
}

static int dt_setup(DtInstance *instance, double start_time)
{
    instance->memory.start_time = start_time;
    instance->memory.known = 0;
    return DT_OK;
}

static int dt_enter_initialisation(DtInstance *instance)
{
    if (instance->memory.phase != DT_INSTANTIATED)
        return dt_error(instance, "The initialisation can be entered once after the instance is made or reset.");
    instance->memory.phase = DT_INITIALISING;
    return DT_OK;
}

static int dt_exit_initialisation(DtInstance *instance)
{
    if (instance->memory.phase != DT_INITIALISING)
        return dt_error(instance, "The initialisation can only be left after it was entered.");
    dt_refresh(&instance->memory);
    instance->memory.phase = DT_STEPPING;
    return DT_OK;
}

/* A communication step: as many periods as it holds, the inputs held throughout. */
static int dt_step(DtInstance *instance, double time, double length)
{
    DtMemory *m = &instance->memory;
    char message[256];
    double periods = floor(length / MODEL_PERIOD + 0.5);
    if (m->phase != DT_STEPPING) return dt_error(instance, "A step can only be made after the initialisation.");
    if (!(fabs(length - periods * MODEL_PERIOD) <= DT_ROUNDING * MODEL_PERIOD && periods >= 1)) {
        snprintf(message, sizeof message,
                 "The communication step is %.17g s, but must be a whole multiple of the model's period of %.17g s.",
                 length, MODEL_PERIOD);
        return dt_error(instance, message);
    }
    if (!(fabs(time - dt_time(m)) <= 0.01 * MODEL_PERIOD)) {
        snprintf(message, sizeof message,
                 "The step should begin at %.17g s, but the model has reached %.17g s.", time, dt_time(m));
        return dt_error(instance, message);
    }
    double *v = m->values, *states = v + MODEL_STATES, next[MODEL_STATE_ROOM];
    for (double i = 0; i < periods; ++i) {
        v[0] = dt_time(m);
        model_step(v + MODEL_PARAMETERS, states, v + MODEL_INPUTS, v, next);
        memcpy(states, next, MODEL_STATE_COUNT * sizeof *states);
        m->steps += 1;
    }
    m->known = 0;
    for (size_t i = 0; i < MODEL_STATE_COUNT; ++i) {
        if (!isfinite(states[i])) {
            snprintf(message, sizeof message,
                     "The model became NaN or infinite by %.17g s: it is unstable for these parameters and inputs.",
                     dt_time(m));
            return dt_error(instance, message);
        }
    }
    return DT_OK;
}

static int dt_terminate(DtInstance *instance)
{
    instance->memory.phase = DT_TERMINATED;
    return DT_OK;
}

static int dt_get_state(DtInstance *instance, void **state)
{
    if (!*state) *state = malloc(sizeof(DtMemory));
    if (!*state) return dt_error(instance, "No memory is left for a copy of the state.");
    memcpy(*state, &instance->memory, sizeof(DtMemory));
    return DT_OK;
}

static int dt_set_state(DtInstance *instance, const void *state)
{
    if (!state) return dt_error(instance, "The state to be set is none.");
    memcpy(&instance->memory, state, sizeof(DtMemory));
    return DT_OK;
}

static int dt_free_state(void **state)
{
    if (state) {
        free(*state);
        *state = NULL;
    }
    return DT_OK;
}

static int dt_serialise(DtInstance *instance, const void *state, void *bytes, size_t size)
{
    DtSerialised out;
    if (!state || size < sizeof out) return dt_error(instance, "There is no state, or no room to serialise it into.");
    memset(&out, 0, sizeof out);
    memcpy(out.token, MODEL_TOKEN, sizeof out.token);
    memcpy(&out.memory, state, sizeof out.memory);
    memcpy(bytes, &out, sizeof out);
    return DT_OK;
}

static int dt_deserialise(DtInstance *instance, const void *bytes, size_t size, void **state)
{
    DtSerialised in;
    if (size < sizeof in) return dt_error(instance, "The serialised state is cut short.");
    memcpy(&in, bytes, sizeof in);
    if (memcmp(in.token, MODEL_TOKEN, sizeof in.token) != 0)
        return dt_error(instance, "The serialised state is another model's.");
    if (!*state) *state = malloc(sizeof(DtMemory));
    if (!*state) return dt_error(instance, "No memory is left for a copy of the state.");
    memcpy(*state, &in.memory, sizeof(DtMemory));
    return DT_OK;
}

#endif
