/* Reads a file named "input" where a program reads its standard input, which QEMU's semihosting does not give a RISC-V.
 * Link with -Wl,--wrap=fgets. */
#include <stdio.h>

char *__real_fgets(char *line, int size, FILE *stream);
char *__wrap_fgets(char *line, int size, FILE *stream);

char *__wrap_fgets(char *line, int size, FILE *stream) {
    static FILE *input;
    (void)stream;
    if (input == NULL) input = fopen("input", "r");
    return input == NULL ? NULL : __real_fgets(line, size, input);
}
