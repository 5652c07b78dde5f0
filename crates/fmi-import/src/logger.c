/* The logger that FMUs of FMI 2.0 call: formats the message as printf does and hands it to log.rs. */

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

void trueup_fmi_log(void *environment, const char *instance, int status, const char *category,
                    const char *message);

void trueup_fmi2_logger(void *environment, const char *instance, int status, const char *category,
                        const char *format, ...) {
    char buffer[1024];
    char *text = buffer;
    va_list arguments, again;

    if (!format) {
        trueup_fmi_log(environment, instance, status, category, NULL);
        return;
    }
    va_start(arguments, format);
    va_copy(again, arguments);
    int length = vsnprintf(buffer, sizeof buffer, format, arguments);
    if (length >= (int)sizeof buffer) {
        text = malloc((size_t)length + 1);
        if (text)
            vsnprintf(text, (size_t)length + 1, format, again);
        else
            text = buffer; /* cut short */
    }
    trueup_fmi_log(environment, instance, status, category, length < 0 ? format : text);
    if (text != buffer)
        free(text);
    va_end(again);
    va_end(arguments);
}
