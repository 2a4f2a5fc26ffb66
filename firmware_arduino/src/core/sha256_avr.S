; SHA-256's inner loops (FIPS 180-4) for the eight-bit processor; sha256.cpp has the same in C++ for any other.
;
; What makes it cheap: turns by whole bytes are names of registers, and of what is left of a sum's three turns
; one is built upon the other, so that five turns by one bit do for each sum. a and e stay in registers through
; the rounds; what they were before stays where it is in memory, so that nothing moves: after four rounds each
; of the eight words is in its old place. Majority by Colin Percival's form: b ^ ((a ^ b) & (b ^ c)), of which
; the second term is the first of the round before.
#ifdef __AVR__

#define A0 r8
#define A1 r9
#define A2 r10
#define A3 r11
#define E0 r12
#define E1 r13
#define E2 r14
#define E3 r15
#define M0 r4 /* b ^ c */
#define M1 r5
#define M2 r6
#define M3 r7
#define T0 r18
#define T1 r19
#define T2 r20
#define T3 r21
#define U0 r22
#define U1 r23
#define U2 r24
#define U3 r25
#define V0 r2
#define V1 r3
#define V2 r16
#define V3 r17

.macro right1 x0, x1, x2, x3
	bst \x0, 0
	lsr \x3
	ror \x2
	ror \x1
	ror \x0
	bld \x3, 7
.endm

.macro left1 x0, x1, x2, x3
	lsl \x0
	rol \x1
	rol \x2
	rol \x3
	adc \x0, r1
.endm

.macro load x0, x1, x2, x3, at
	ldd \x0, Y + \at
	ldd \x1, Y + \at + 1
	ldd \x2, Y + \at + 2
	ldd \x3, Y + \at + 3
.endm

.macro store at, x0, x1, x2, x3
	std Y + \at, \x0
	std Y + \at + 1, \x1
	std Y + \at + 2, \x2
	std Y + \at + 3, \x3
.endm

.macro add4 x0, x1, x2, x3, y0, y1, y2, y3
	add \x0, \y0
	adc \x1, \y1
	adc \x2, \y2
	adc \x3, \y3
.endm

.macro xor4 x0, x1, x2, x3, y0, y1, y2, y3
	eor \x0, \y0
	eor \x1, \y1
	eor \x2, \y2
	eor \x3, \y3
.endm

; One byte of choice, g ^ (e & (f ^ g)), added with what is carried over: logic leaves the carry alone.
.macro choose op, t, e, f, g
	ldd r16, Y + \g
	ldd r17, Y + \f
	eor r17, r16
	and r17, \e
	eor r17, r16
	\op \t, r17
.endm

; One byte of majority, added; m becomes a ^ b.
.macro agree op, t, a, m, b
	ldd r16, Y + \b
	mov r17, \a
	eor r17, r16
	and \m, r17
	eor \m, r16
	\op \t, \m
	mov \m, r17
.endm

.macro add_byte op, t, from
	\from
	\op \t, r0
.endm

; One round; places of b, d, f, g, h from Y. The new e goes where h was, the new a where d was.
.macro round b, d, f, g, h
	load T0, T1, T2, T3, \h
	ld r0, X+
	add T0, r0
	ld r0, X+
	adc T1, r0
	ld r0, X+
	adc T2, r0
	ld r0, X+
	adc T3, r0
	lpm r0, Z+
	add T0, r0
	lpm r0, Z+
	adc T1, r0
	lpm r0, Z+
	adc T2, r0
	lpm r0, Z+
	adc T3, r0
	choose add, T0, E0, \f, \g
	choose adc, T1, E1, \f + 1, \g + 1
	choose adc, T2, E2, \f + 2, \g + 2
	choose adc, T3, E3, \f + 3, \g + 3
	; sum over e: 11 = 8 + 2 + 1 and 25 = 24 + 1 to the right, 6 = 8 - 2
	movw U0, E0
	movw U2, E2
	right1 U0, U1, U2, U3
	right1 U0, U1, U2, U3
	xor4 U0, U1, U2, U3, E2, E3, E0, E1
	right1 U0, U1, U2, U3
	movw V0, E0
	movw V2, E2
	left1 V0, V1, V2, V3
	left1 V0, V1, V2, V3
	xor4 U0, U1, U2, U3, V0, V1, V2, V3
	add4 T0, T1, T2, T3, U1, U2, U3, U0
	load E0, E1, E2, E3, \d
	add4 E0, E1, E2, E3, T0, T1, T2, T3
	store \h, E0, E1, E2, E3
	agree add, T0, A0, M0, \b
	agree adc, T1, A1, M1, \b + 1
	agree adc, T2, A2, M2, \b + 2
	agree adc, T3, A3, M3, \b + 3
	; sum over a: 22 = 24 - 2 and 13 = 16 - 2 - 1 to the right, 2
	movw U0, A0
	movw U2, A2
	left1 U0, U1, U2, U3
	xor4 U0, U1, U2, U3, A1, A2, A3, A0
	left1 U0, U1, U2, U3
	left1 U0, U1, U2, U3
	movw V0, A0
	movw V2, A2
	right1 V0, V1, V2, V3
	right1 V0, V1, V2, V3
	xor4 U2, U3, U0, U1, V0, V1, V2, V3
	movw A0, U2
	movw A2, U0
	add4 A0, A1, A2, A3, T0, T1, T2, T3
	store \d, A0, A1, A2, A3
.endm

	.text

; void hil_sha256_rounds(uint32_t v[8], const uint32_t* w, const uint32_t* k, uint8_t fours):
; four rounds `fours` times; v is a to h, w and k (in flash) the words that come next.
	.global hil_sha256_rounds
	.type hil_sha256_rounds, @function
hil_sha256_rounds:
	push r2
	push r3
	push r4
	push r5
	push r6
	push r7
	push r8
	push r9
	push r10
	push r11
	push r12
	push r13
	push r14
	push r15
	push r16
	push r17
	push r28
	push r29
	movw r28, r24
	movw r26, r22
	movw r30, r20
	push r18
	load A0, A1, A2, A3, 0
	load E0, E1, E2, E3, 16
	load M0, M1, M2, M3, 4
	load U0, U1, U2, U3, 8
	xor4 M0, M1, M2, M3, U0, U1, U2, U3
1:	; b  d   f   g   h
	round 4, 12, 20, 24, 28
	round 0, 8, 16, 20, 24
	round 12, 4, 28, 16, 20
	round 8, 0, 24, 28, 16
	pop r0
	dec r0
	breq 2f
	push r0
	rjmp 1b
2:	pop r29
	pop r28
	pop r17
	pop r16
	pop r15
	pop r14
	pop r13
	pop r12
	pop r11
	pop r10
	pop r9
	pop r8
	pop r7
	pop r6
	pop r5
	pop r4
	pop r3
	pop r2
	ret
	.size hil_sha256_rounds, . - hil_sha256_rounds

; void hil_sha256_extend(uint32_t* w, uint8_t n): w[16] to w[16 + n - 1] from the sixteen before each.
	.global hil_sha256_extend
	.type hil_sha256_extend, @function
hil_sha256_extend:
	push r2
	push r3
	push r16
	push r17
	push r28
	push r29
	mov r31, r22
	movw r28, r24
	movw r26, r24
	subi r26, lo8(-64)
	sbci r27, hi8(-64)
1:	load U0, U1, U2, U3, 4
	; turns by 7 = 8 - 1 and 18 = 16 + 2, shift by 3
	movw V0, U0
	movw V2, U2
	left1 V0, V1, V2, V3
	right1 U0, U1, U2, U3
	right1 U0, U1, U2, U3
	xor4 V1, V2, V3, V0, U2, U3, U0, U1
	andi U3, 0x3F
	lsr U3
	ror U2
	ror U1
	ror U0
	xor4 V1, V2, V3, V0, U0, U1, U2, U3
	load T0, T1, T2, T3, 0
	add4 T0, T1, T2, T3, V1, V2, V3, V0
	load U0, U1, U2, U3, 36
	add4 T0, T1, T2, T3, U0, U1, U2, U3
	load U0, U1, U2, U3, 56
	; turns by 17 = 16 + 1 and 19 = 16 + 1 + 2, shift by 10 = 8 + 2
	right1 U0, U1, U2, U3
	movw V0, U0
	movw V2, U2
	right1 U0, U1, U2, U3
	eor V2, U1
	eor V3, U2
	mov r30, U3
	andi r30, 0x3F
	eor V0, r30
	right1 U0, U1, U2, U3
	xor4 V0, V1, V2, V3, U0, U1, U2, U3
	add4 T0, T1, T2, T3, V2, V3, V0, V1
	st X+, T0
	st X+, T1
	st X+, T2
	st X+, T3
	adiw r28, 4
	dec r31
	breq 2f
	rjmp 1b
2:	pop r29
	pop r28
	pop r17
	pop r16
	pop r3
	pop r2
	ret
	.size hil_sha256_extend, . - hil_sha256_extend

#endif
